"""Flight: what mechanics conserves stays, what damping takes is accounted for, and torque laws act
as written.
"""

import numpy as np
import pytest

SEGMENTS, LINKS = 2, 2
NQ, NV, NT = 7 + 2 * SEGMENTS, 6 + 2 * SEGMENTS, 2 * SEGMENTS
WANTED = ["mass_matrix", "forward_dynamics", "energy", "momentum", "tail_points", "rollout"]
Q0 = np.array([0.1, -0.2, 0.3, 0.8, -0.4, 0.4, 0.2, 0.5, -0.4, 0.3, 0.6])
V0 = np.array([0.3, -0.5, 1.2, 4.0, -2.0, 3.0, 8.0, -6.0, 5.0, 7.0])
DAMPING = (2e-6, 1e-6, 3e-6, 4e-6)  # N m s, small enough for a tail that swings
METHODS = {name: {"method": name} for name in ("rk4", "tsit5", "dop853")}
both = pytest.mark.parametrize("settings", METHODS.values(), ids=METHODS)

"""Models: every function takes any array of numbers, alone or in batches, and refuses the rest by
name.
"""

from functools import partial

import numpy as np
import pytest

from ...support.models import model_folder

SEGMENTS, LINKS = 2, 1
NQ, NV, NT, POINTS = 7 + 2 * SEGMENTS, 6 + 2 * SEGMENTS, 2 * SEGMENTS, SEGMENTS * LINKS + 1
SIZES = {"q": NQ, "v": NV, "v_dot": NV, "tau": NT, "f_ext": 6 + 3 * POINTS}
SIZES |= {"dq": NV, "dv": NV, "dtau": NT, "multiplier": NV, "accelerations": NT}
NX, NY = 4 + 2 * NT, 7 + 2 * NT
SIZES |= {"x": NX, "angular": 3, "weights": NY}
# Every function: its arguments and the shapes of what it returns.
CALLS = {
    "mass_matrix": (["q"], [(NV, NV)]),
    "bias_force": (["q", "v"], [(NV,)]),
    "inverse_dynamics": (["q", "v", "v_dot"], [(NV,)]),
    "forward_dynamics": (["q", "v", "tau"], [(NV,)]),
    "forward_dynamics_external": (["q", "v", "tau", "f_ext"], [(NV,)]),
    "energy": (["q", "v"], [(), ()]),
    "momentum": (["q", "v"], [(3,), (3,)]),
    "center_of_mass": (["q", "v"], [(3,), (3,), (3, NV)]),
    "tail_points": (["q"], [(POINTS, 3)]),
    "tail_point_jacobians": (["q"], [(POINTS, 3, NV)]),
    "mass_matrix_world": (["q"], [(NV, NV)]),
    "bias_force_world": (["q", "v"], [(NV,)]),
    "forward_dynamics_derivatives": (["q", "v", "tau"], [(NV, NV), (NV, NV), (NV, NT)]),
    "forward_dynamics_parameter_derivatives": (["q", "v", "tau"], [(NV, 13)]),
    "forward_dynamics_jvp": (["q", "v", "tau", "dq", "dv", "dtau"], [(NV,)]),
    "forward_dynamics_vjp": (["q", "v", "tau", "multiplier"], [(NV,), (NV,), (NT,)]),
    "inverse_dynamics_derivatives": (["q", "v", "v_dot"], [(NV, NV), (NV, NV)]),
    "inverse_dynamics_parameter_derivatives": (["q", "v", "v_dot"], [(NV, 13)]),
    "inverse_dynamics_vjp": (["q", "v", "v_dot", "multiplier"], [(NV,), (NV,), (NV,)]),
    "inverse_dynamics_hessian": (["q", "v", "v_dot", "multiplier"], [(NV, NV)] * 4),
    "energy_derivatives": (["q", "v"], [(NV,), (NV,), (NV,)]),
    "momentum_derivatives": (["q", "v"], [(3, NV)] * 4),
    "pfl": (["q", "v", "accelerations"], [(NT,)]),
    "airborne_rates": (["x", "tau", "angular"], [(NY,)]),
    "airborne_rates_derivatives": (["x", "tau", "angular"], [(NY,), (NY, NX + NT)]),
    "airborne_rates_hessian": (
        ["x", "tau", "angular", "weights"],
        [(NY,), (NY, NX + NT), (NX + NT, NX + NT)],
    ),
}
every_function = pytest.mark.parametrize("name", CALLS)
folder = partial(model_folder, SEGMENTS, LINKS, name="tail", functions="all")


def states(count, seed=1):
    """Arguments by name, each (count, size), the quaternions of any norm."""
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(-2, 2, (count, size)) for name, size in SIZES.items()}


def state(seed=1):
    """Arguments of one state by name."""
    return {name: rows[0] for name, rows in states(1, seed).items()}


def call(model, name, arguments):
    """The outputs of a function, always in a tuple."""
    method = model.forward_dynamics if name == "forward_dynamics_external" else getattr(model, name)
    result = method(*(arguments[argument] for argument in CALLS[name][0]))
    return result if isinstance(result, tuple) else (result,)


def assert_same(found, expected):
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)

"""The first guess: attitudes that hidden torsos leave open, its time, and scales that are wrong."""

import numpy as np
from scipy.spatial.transform import Rotation

from serpentail.identification.placement import placements
from serpentail.identification.start import motion_shown
from tests.identification.flights import TORSO, flown, hidden, placed, start, tracks
from tests.support import zoo
from tests.support.rows import row

TIMES = np.linspace(0, 0.15, 31)


def turned_by(a, b):
    """Angles (F,) in degrees between the attitudes of configurations."""
    one, other = (Rotation.from_quat(each[:, [4, 5, 6, 3]]) for each in (a, b))
    return np.degrees((one.inv() * other).magnitude())


def test_the_torso_may_be_hidden_in_the_first_frames():
    """60 flights of any attitude; all or some of the torso is hidden in frames 0 to 5."""
    for seed in range(60):
        model = zoo.model(("m1_n3", "m2_n2", "arcs2")[seed % 3])
        x, rng = start(model, seed), np.random.default_rng([seed, 7])
        x[3:7] = Rotation.random(random_state=seed).as_quat()
        states = flown(model, TIMES, x, rtol=1e-6)
        names = list(TORSO) if seed % 2 else rng.choice(list(TORSO), 2 + seed % 4 // 2, False)
        data = tracks(model, TIMES, states, 5e-4, seed=seed, gaps=0.1)
        data = hidden(data, names, slice(1 + seed % 6))
        shown = motion_shown(model, placements(model, placed(model)), data)
        with row(seed):
            assert turned_by(shown, states).max() < 45
            assert np.abs(shown[:, 7 : model.nq] - states[:, 7 : model.nq]).max() < 0.7

"""Models of passive tails for tests, and the same models without their passive parts."""

from functools import cache

import numpy as np

import serpentail as st
from tests.support.models import model_folder

FUNCTIONS = ["energy", "momentum", "forward_dynamics", "mass_matrix", "rollout", "implicit", "pfl"]
SIZES = {"chain": (2, 3), "arcs": (2, None)}
SPRING = {"tail_stiffness": 0.004, "tail_rest": 0.15}
DAMPING = {"tail_damping": 2e-4}
STOPS = {"tail_stop_lower": -0.5, "tail_stop_upper": 0.6, "tail_stop_stiffness": 0.05}
ALL = SPRING | DAMPING | STOPS


def elastic_model(segments, links, parameters=None, **options):
    """The model of a tail with passive parts, by default with all of them."""
    given = ALL if parameters is None else parameters
    return plain_model(segments, links, parameters=given, **options)


def plain_model(segments, links, **options):
    """The model of a tail without them."""
    return _loaded(model_folder(segments, links, **options))


@cache
def _loaded(folder):
    return st.load(folder)


def unequal(segments):
    """Return parameters of all passive parts, different ones for each coordinate."""
    rng, size = np.random.default_rng(17), 2 * segments
    return {
        "tail_stiffness": rng.uniform(0.001, 0.01, size),
        "tail_rest": rng.uniform(-0.3, 0.3, size),
        "tail_damping": rng.uniform(1e-5, 1e-3, size),
        "tail_stop_lower": rng.uniform(-0.9, -0.2, size),
        "tail_stop_upper": rng.uniform(0.2, 0.9, size),
        "tail_stop_stiffness": rng.uniform(0.01, 0.1, size),
        "tail_stop_width": rng.uniform(0.02, 0.2, size),
    }


def of_parameters(name, parameters):
    """A model of a chain or of arcs with these parameters."""
    return elastic_model(*SIZES[name], parameters, functions=FUNCTIONS)


def bent(model, angles):
    """A start at rest with an upright torso."""
    q = np.zeros(model.nq)
    q[3], q[7:] = 1, angles
    return q, np.zeros(model.nv)

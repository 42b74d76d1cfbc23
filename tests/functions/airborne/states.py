"""Airborne states of every kind, and models of them."""

from functools import cache

import numpy as np

import serpentail as st
from serpentail_codegen.scene.signatures.table import AIRBORNE
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.parameters import random_states
from tests.support.models import model_folder

KINDS = ("random", "straight", "folded", "still", "scaled")
OTHERS = ("forward_dynamics", "inverse_dynamics", "momentum", "mass_matrix")


@cache
def airborne_model(segments, links, emission):
    """A compiled model with the functions of nodes, and what they are compared with."""
    functions = [*AIRBORNE, *OTHERS]
    folder = model_folder(segments, links, emission=emission, name="airborne", functions=functions)
    return st.load(folder)


@cache
def exact_tail(segments, links):
    """The 40-digit reference of a model with these sizes."""
    parameters = dict(airborne_model(segments, links, "loops").parameters)
    if links is None:
        return ExactContinuum(parameters, segments)
    return ExactChain(parameters, segments, links)


def moving_states(segments, kind, count=2):
    """Tuples (q, v, tau), B at the origin and at rest; quaternions of any norm if "scaled"."""
    tails = kind if kind in ("straight", "folded") else "random"
    q, v, _, tau = random_states(segments, 31, count, tails)
    if kind == "scaled":
        q[:, 3:7] *= np.random.default_rng(37).uniform(0.2, 5, (count, 1))
    q[:, :3], v[:, :3] = 0, 0
    v *= kind != "still"
    return list(zip(q, v, tau, strict=True))


def airborne_arguments(q, v, tau, angular):
    """Arguments of one call by name, with weights of the order of one over each rate's size."""
    segments = len(tau) // 2
    sizes = np.repeat([1, 10, 500, 20], [4, 2 * segments, 2 * segments, 3])
    weights = np.random.default_rng(41).normal(size=len(sizes)) / sizes
    x = np.concatenate([q[3:], v[6:]])
    return {"x": x, "tau": tau, "angular": np.asarray(angular), "weights": weights}


def rates(arguments):
    """Those arguments that rates depend on."""
    return [arguments[name] for name in ("x", "tau", "angular")]

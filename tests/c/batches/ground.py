"""Models that touch the ground, and states of them in which all points press, some, or none."""

from functools import cache

import numpy as np

import serpentail as st

from ...support.models import model_folder
from .tails import GROUND

ARGUMENTS = {
    "contact_points": ("q", "v", "legs"),
    "leg_points": ("q", "angles"),
    "contact_dynamics": ("q", "v", "tau", "bristles", "legs"),
}
CONTACTS = ["feet", "tail", "torso"]
UPRIGHT, LEGS = [1, 0, 0, 0], [3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0]
TOUCHING = ("all", "some", "none")


@cache
def model(kind="articulated", segments=2, links=2, profile="fast", **options):
    """A model with all functions of contact that have batches."""
    options = {"contacts": CONTACTS, "functions": list(GROUND)} | options
    folder = model_folder(segments, links, name=f"{kind}_ground", **options)
    return st.load(folder, profile=profile)


def states(model, touching, seed=0):
    """Random states by name, one for each word of ``touching``: how many points press there.

    With "some", the height of the animal is drawn between those of its lowest and highest point.
    """
    rng, count = np.random.default_rng(seed), len(touching)
    q, v = np.zeros((count, model.nq)), 0.3 * rng.normal(size=(count, model.nv))
    v[:, 2] -= 1  # m/s: points in the ground press, for they sink
    q[:, 3:7] = UPRIGHT + 0.2 * rng.normal(size=(count, 4))
    q[:, 7:] = 0.3 * rng.normal(size=(count, model.nv - 6))
    legs = LEGS + 0.1 * rng.normal(size=(count, 8))
    values = {"q": q, "v": v, "legs": legs, "angles": legs[:, :4].copy()}
    values["tau"] = 1e-4 * rng.normal(size=(count, model.nv - 6))
    values["bristles"] = 1e-3 * rng.normal(size=(count, 2 * sum(model.contacts.values())))
    for k, word in enumerate(touching):
        heights = np.sort(model.contact_points(q[k], v[k], legs[k])[0][:, 2])
        between = rng.uniform(heights[0], heights[-1])
        q[k, 2] = -{"all": heights[-1] + 1e-3, "some": between, "none": heights[0] - 0.01}[word]
    return values


def pressing(model, values, k):
    """How many points of a state press on the ground."""
    state = [values[name][k] for name in ARGUMENTS["contact_dynamics"]]
    return np.count_nonzero(model.contact_dynamics(*state)[2][:, 2])

"""States on the ground in which all points press, some, or none."""

import numpy as np

CONTACTS = ["feet", "tail", "torso"]
UPRIGHT, LEGS = [1, 0, 0, 0], [3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0]
TOUCHING = ("all", "some", "none")


def states(model, touching, seed=0):
    """Random states by name, one for each word of ``touching``: how many points press there.

    With "some", the height of the animal is drawn between those of its lowest and highest point.
    A model without feet has no legs, and takes None for them.
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
    feet = "feet" in model.contacts
    for k, word in enumerate(touching):
        heights = np.sort(model.contact_points(q[k], v[k], legs[k] if feet else None)[0][:, 2])
        between = rng.uniform(heights[0], heights[-1])
        q[k, 2] = -{"all": heights[-1] + 1e-3, "some": between, "none": heights[0] - 0.01}[word]
    return values


def pressing(model, values, k):
    """How many points of a state press on the ground."""
    names = ("q", "v", "tau", "bristles", *(["legs"] if "feet" in model.contacts else []))
    forces = model.contact_dynamics(*(values[name][k] for name in names))[2]
    return np.count_nonzero(forces[:, 2])

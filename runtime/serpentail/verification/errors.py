"""Errors without units: how far outputs are from their references."""

import numpy as np

from ..model.model import Model
from .states import State, outputs, total_mass

BLOCKS = (
    slice(0, 3),
    slice(3, 6),
    slice(6, None),
)  # of forces and accelerations: B's translation, rotation, tail
NEGLIGIBLE = 1e-6  # a block this much smaller than the largest is scaled by the largest


def is_derivative(model: Model, name: str) -> bool:
    """Tell if a function is a derivative: CasADi's own differentiation stands for those."""
    return model.manifest["functions"][name]["group"] == "derivative"


def rounding(model: Model) -> float:
    """Return eps of the model's real type."""
    return float(np.finfo(model.parameter_vector.dtype).eps)


def differences(model: Model, name: str, state: State, references) -> float:
    """Return the largest error of a function's outputs against references, in order; what is solved
    for, by cond(H).
    """
    found = outputs(model, name, state).items()
    pairs = [(key, x, reference) for (key, x), reference in zip(found, references, strict=True)]
    solved = name.startswith("forward_dynamics_") and is_derivative(model, name)
    return worst(
        relative(x, reference, max(size, np.max(np.abs(reference))))
        if (size := cancelled(model, key, state))
        else difference(model, state.q, key, x, reference)
        for key, x, reference in pairs
    ) / (sensitivity(model, state.q) if solved else 1.0)


def cancelled(model: Model, output: str, state: State) -> float:
    """Return the size of what the whole animal's translation adds to a derivative, which cancels in
    its turns, or 0.
    """
    speed, weights = (np.linalg.norm(x[:3]) for x in (state.v, state.multiplier))
    load = np.linalg.norm(state.v_dot[:3]) + model.parameters["gravity"]
    sizes = {"kinetic_dq": speed**2, "qq": load * weights, "aq": weights}
    return total_mass(model) * sizes.get(output, 0.0)


def same_bits(model: Model, names, state: State, other: State) -> dict[str, float]:
    """Return by function how many outputs differ between two states."""
    return {
        name: differing_outputs(outputs(model, name, state), outputs(model, name, other))
        for name in names
    }


def differing_outputs(found: dict, others: dict) -> float:
    """Return how many numbers of all outputs differ in some bit."""
    return sum(differing(found[key], others[key]) for key in found)


# Errors without units


def turned_array(x: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Turn the axes of a result that are as long as a velocity, or a vector."""
    for axis, size in enumerate(np.shape(x)):
        turn = {len(X): X, 3: X[:3, :3]}.get(size)
        if turn is not None:
            x = np.moveaxis(np.tensordot(turn, x, (1, axis)), 0, axis)
    return x


def worst(errors) -> float:
    """Return the largest error; one that is no number is the worst."""
    return float(np.max(list(errors), initial=0.0))


def relative(x, reference, scale=None) -> float:
    """Return max|x - reference| / max|scale|, by default of the reference."""
    size = np.max(np.abs(reference if scale is None else scale), initial=np.finfo(float).tiny)
    return float(np.max(np.abs(np.subtract(x, reference, dtype=float)), initial=0.0) / size)


def block_error(x, reference, scale=None) -> float:
    """Return the largest relative error of the three blocks of a force or an acceleration."""
    scale = np.abs(reference if scale is None else scale)
    floor = NEGLIGIBLE * np.max(scale)
    return worst(relative(x[b], reference[b], np.maximum(scale[b], floor)) for b in BLOCKS)


def matrix_error(H, reference) -> float:
    """Return max |dH_ij| / sqrt(H_ii H_jj), so that the torso's mass does not hide the tail."""
    scale = np.sqrt(np.diag(reference).astype(float))
    return float(np.max(np.abs(np.subtract(H, reference, dtype=float)) / np.outer(scale, scale)))


def condition(H) -> float:
    """Return the condition number of H scaled to a unit diagonal."""
    scale = np.sqrt(np.diag(H).astype(float))
    return float(np.linalg.cond(H / np.outer(scale, scale)))


def sensitivity(model: Model, q: np.ndarray) -> float:
    """Return the condition number that an error of v_dot is divided by; of its tail's part where H
    is missing.

    1 where neither H nor v_dot is there.
    """
    if "mass_matrix" in model.kernels:
        return condition(model.mass_matrix(q))
    if not model.kernels.keys() & {"forward_dynamics", "forward_dynamics_external"}:
        return 1.0
    tau = np.eye(model.nv - 5, model.nv - 6, -1)
    load = None if "forward_dynamics" in model.kernels else model.external_force()
    v_dot = model.forward_dynamics(q, np.zeros(model.nv), tau, load)
    return condition((v_dot[1:] - v_dot[0])[:, 6:])


def difference(model: Model, q: np.ndarray, output: str, x, reference) -> float:
    """Return the error of one output of a function, by the measure that suits it."""
    x, reference = (np.asarray(y, float) for y in (x, reference))
    if output == "H":
        return matrix_error(x, reference)
    if output == "force":
        return block_error(x, reference)
    if output == "v_dot":
        return block_error(x, reference) / sensitivity(model, q)
    if output == "potential":
        height = (
            abs(q[2])
            + model.parameters["tail_length"]
            + np.linalg.norm(model.parameters["tail_mount"])
        )
        return relative(x, reference, total_mass(model) * model.parameters["gravity"] * height)
    return relative(x, reference)


def differing(x, other) -> float:
    """Return how many numbers differ in some bit; a zero has no sign."""
    x, other = (np.ascontiguousarray(y) + 0.0 for y in (x, other))
    if (x.shape, x.dtype) != (other.shape, other.dtype):
        return np.inf
    bits = f"u{x.dtype.itemsize}"
    return float(np.sum(x.view(bits) != other.view(bits)))

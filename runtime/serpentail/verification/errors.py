"""Errors without units: how far outputs are from their references."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import OMEGA, POSITION, TAIL_V, VELOCITY

from ..basics.attitude import pose_of
from ..model.model import Model
from ..model.weight import fall, total_mass, weight_of
from .states import Case, outputs

BLOCKS = (VELOCITY, OMEGA, TAIL_V)  # of forces and accelerations: B's translation, rotation, tail
Blocks = tuple[slice, ...]
NEGLIGIBLE = 1e-6  # a block this much smaller than the largest is scaled by the largest


def is_derivative(model: Model, name: str) -> bool:
    """Tell if a function is a derivative: CasADi's own differentiation stands for those."""
    return bool(model.manifest["functions"][name]["group"] == "derivative")


def rounding(model: Model) -> float:
    """Return eps of the model's real type."""
    return float(np.spacing(np.ones((), model.parameter_vector.dtype)))


def differences(model: Model, name: str, state: Case, references: Iterable[ArrayLike]) -> float:
    """Return the largest error of a function's outputs against references, in order.

    Errors of derivatives of v_dot are divided by cond(H).
    """
    errors = []
    results = outputs(model, name, state)
    for (output, x), reference in zip(results.items(), references, strict=True):
        size = cancelling_size(model, output, state)
        if size:
            errors.append(relative(x, reference, max(size, np.max(np.abs(reference)))))
        else:
            errors.append(difference(model, state.q, output, x, reference))
    solved = name.startswith("forward_dynamics_") and is_derivative(model, name)
    solved |= name.startswith("airborne_")
    return worst(errors) / (sensitivity(model, state.q) if solved else 1.0)


def cancelling_size(model: Model, output: str, state: Case) -> float:
    """Return how large the terms of a derivative are that must cancel; 0 where none do.

    Rotating the torso does not change how B moves.  The terms by which the whole mass moves with B
    cancel in derivatives by rotations, and leave their rounding.
    """
    if model.fixed:
        return 0.0
    speed, weights = (float(np.linalg.norm(x[VELOCITY])) for x in (state.v, state.multiplier))
    load = sum(np.linalg.norm(x) for x in (state.v_dot[VELOCITY], fall(model.parameters)))
    sizes = {"kinetic_dq": speed**2, "qq": load * weights, "aq": weights}
    return total_mass(model.parameters) * sizes.get(output, 0.0)


def same_bits(model: Model, names: Iterable[str], state: Case, other: Case) -> dict[str, float]:
    """Return by function how many outputs differ between two states."""
    return {
        name: differing_outputs(outputs(model, name, state), outputs(model, name, other))
        for name in names
    }


def differing_outputs(outputs: dict, others: dict) -> float:
    """Return how many numbers of all outputs differ in at least one bit."""
    return sum(differing(outputs[key], others[key]) for key in outputs)


def turned_array(x: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Turn the axes of a result that are as long as a velocity, or a vector."""
    for axis, size in enumerate(np.shape(x)):
        turn = {len(X): X, 3: X[VELOCITY, VELOCITY]}.get(size)
        if turn is not None:
            x = np.moveaxis(np.tensordot(turn, x, (1, axis)), 0, axis)
    return x


def worst(errors: Iterable[float]) -> float:
    """Return the largest error; nan counts as the worst."""
    return float(np.max(list(errors), initial=0.0))


def relative(x: ArrayLike, reference: ArrayLike, scale: ArrayLike | None = None) -> float:
    """Return max|x - reference| / max|scale|, by default of the reference."""
    sizes = np.abs(np.asarray(reference if scale is None else scale, float))  # tiny is a double's
    size = np.max(sizes, initial=np.finfo(float).tiny)
    return float(np.max(np.abs(np.subtract(x, reference, dtype=float)), initial=0.0) / size)


def blocks_of(model: Model) -> Blocks:
    """Return the blocks of forces and accelerations: a tail on a fixed base is one."""
    return (slice(None),) if model.fixed else BLOCKS


def block_error(x: Any, reference: Any, scale: Any = None, blocks: Blocks = BLOCKS) -> float:
    """Return the largest relative error of the blocks of a force or an acceleration."""
    scale = np.abs(reference if scale is None else scale)
    floor = NEGLIGIBLE * np.max(scale)
    return worst(relative(x[b], reference[b], np.maximum(scale[b], floor)) for b in blocks)


def matrix_error(H: np.ndarray, reference: np.ndarray) -> float:
    """Return max |dH_ij| / sqrt(H_ii H_jj), so that the torso's mass does not hide the tail."""
    scale = np.sqrt(np.diag(reference).astype(float))
    return float(np.max(np.abs(np.subtract(H, reference, dtype=float)) / np.outer(scale, scale)))


def condition(H: np.ndarray) -> float:
    """Return the condition number of H scaled to a unit diagonal."""
    scale = np.sqrt(np.diag(H).astype(float))
    return float(np.linalg.cond(H / np.outer(scale, scale)))


def sensitivity(model: Model, q: np.ndarray) -> float:
    """Return cond(H), which divides errors of v_dot; without H that of the tail's part, or 1."""
    if "mass_matrix" in model.kernels:
        return condition(model.mass_matrix(q))
    if not model.kernels.keys() & {"forward_dynamics", "forward_dynamics_external"}:
        return 1.0
    tail = model.layout.nt
    tau = np.eye(tail + 1, tail, -1)  # none, then each torque alone
    load = None if "forward_dynamics" in model.kernels else model.external_force()
    v_dot = model.forward_dynamics(q, np.zeros(model.nv), tau, load)
    return condition((v_dot[1:] - v_dot[0])[:, model.layout.tail_v])


def difference(
    model: Model, q: np.ndarray, output: str, x: ArrayLike, reference: ArrayLike
) -> float:
    """Return the error of one output of a function, by the measure that suits it."""
    x, reference = np.asarray(x, float), np.asarray(reference, float)
    if output == "H":
        return matrix_error(x, reference)
    if output == "force":
        return block_error(x, reference, blocks=blocks_of(model))
    if output == "v_dot":
        return block_error(x, reference, blocks=blocks_of(model)) / sensitivity(model, q)
    if output == "potential":
        mount = np.linalg.norm(model.parameters["tail_mount"])
        reach, p = model.parameters["tail_length"] + mount, model.parameters
        lifted = total_mass(p) * abs(pose_of(q, model.layout)[POSITION] @ fall(p))
        return relative(x, reference, lifted + weight_of(p) * reach)
    return relative(x, reference)


def differing(x: ArrayLike, other: ArrayLike) -> float:
    """Return how many numbers differ in some bit; a zero has no sign."""
    x, other = np.ascontiguousarray(x) + 0.0, np.ascontiguousarray(other) + 0.0
    if (x.shape, x.dtype) != (other.shape, other.dtype):
        return np.inf
    bits = f"u{x.dtype.itemsize}"
    return float(np.sum(x.view(bits) != other.view(bits)))

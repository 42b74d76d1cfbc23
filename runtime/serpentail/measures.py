"""Measures: a model goes in; seeded states, its outputs there, and how far outputs differ, without units, come out."""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from .errors import ModelError
from .model.model import Model

KINDS = ("random", "straight", "folded")
BLOCKS = (slice(0, 3), slice(3, 6), slice(6, None))  # of forces and accelerations: B's translation, rotation, tail
NEGLIGIBLE = 1e-6  # a block this much smaller than the largest is scaled by the largest

DERIVATIVES = (  # functions that CasADi's own differentiation stands for
    "forward_dynamics_derivatives",
    "forward_dynamics_parameter_derivatives",
    "forward_dynamics_jvp",
    "forward_dynamics_vjp",
    "inverse_dynamics_derivatives",
    "inverse_dynamics_parameter_derivatives",
    "inverse_dynamics_vjp",
    "inverse_dynamics_hessian",
    "energy_derivatives",
    "momentum_derivatives",
)


@dataclass(frozen=True)
class State:
    """One state of a model, all arguments that its functions take."""

    kind: str
    q: np.ndarray
    v: np.ndarray
    v_dot: np.ndarray
    tau: np.ndarray
    f_ext: np.ndarray
    dq: np.ndarray  # directions of q (in its tangent space), v and tau
    dv: np.ndarray
    dtau: np.ndarray
    multiplier: np.ndarray

    @property
    def accelerations(self) -> np.ndarray:
        """Wanted accelerations of the tail coordinates."""
        return self.v_dot[6:]


def rounding(model: Model) -> float:
    """Return eps of the model's real type."""
    return float(np.finfo(model.parameter_vector.dtype).eps)


def states(model: Model, count: int = 4, seed: int = 1) -> Iterator[State]:
    """Yield ``count`` states of each kind, every number exact in the model's real type; ModelError for polar angles."""
    if model.manifest["scene"]["coordinates"] == "polar":
        remedy = 'verify the same scene with coordinates = "bend"'
        raise ModelError(f"{model.name}: polar coordinates lose digits and have no straight tail: {remedy}")
    torque = 10 * model.parameters["tail_mass"] * model.parameters["tail_length"] ** 2  # at 10 rad/s^2
    rng, real = np.random.default_rng(seed), model.parameter_vector.dtype
    for kind in KINDS:
        for k in range(count):
            q = np.concatenate([rng.uniform(-1, 1, 3), direction(rng, 4), tail_angles(model, rng, kind, k)])
            v, v_dot = (blocks(rng, model.nv, s) for s in ((2.0, 20.0, 10.0), (20.0, 500.0, 500.0)))
            tau = rng.uniform(-torque, torque, model.nv - 6)
            f_ext = total_mass(model) * rng.uniform(-1, 1, len(model.external_force()))  # at 1 m/s^2
            f_ext[3:6] *= model.parameters["tail_length"]
            directions = [rng.uniform(-1, 1, len(x)) for x in (v, v, tau, v)]
            yield State(kind, *(x.astype(real).astype(float) for x in (q, v, v_dot, tau, f_ext, *directions)))


def total_mass(model: Model) -> float:
    """Return the mass of torso and tail (kg)."""
    return model.parameters["torso_mass"] + model.parameters["tail_mass"]


def direction(rng, size: int) -> np.ndarray:
    """Return a unit vector, uniform over all directions; of size 4 a quaternion, uniform over the rotations."""
    vector = rng.normal(size=size)
    return vector / np.linalg.norm(vector)


def tail_angles(model: Model, rng, kind: str, k: int) -> np.ndarray:
    """Return no bend; bends of up to 1 rad; or, in turn, joints within 0.01 rad of +-pi and within two turns.

    The bends of a continuum keep within its range, also where a law moves on from the state.
    """
    size, reach = model.nv - 6, model.manifest["scene"].get("bend_range", np.inf)
    if kind == "straight":
        return np.zeros(size)
    if kind == "random":
        return rng.uniform(-1, 1, size) * min(1, reach / 4)
    if model.manifest["scene"]["kind"] == "continuum":
        return np.concatenate([rng.uniform(0.3, 0.6) * reach * direction(rng, 2) for _ in range(size // 2)])
    near_pi = rng.choice([-np.pi, np.pi], size) + rng.uniform(-0.01, 0.01, size)
    return near_pi if k % 2 == 0 else rng.uniform(-2 * np.pi, 2 * np.pi, size)


def blocks(rng, nv: int, scales: tuple[float, float, float]) -> np.ndarray:
    """Return a vector like v, each block uniform within its own scale."""
    return np.concatenate([rng.uniform(-s, s, size) for s, size in zip(scales, (3, 3, nv - 6), strict=True)])


def scaled(s: State, factor: float) -> State:
    """Return another state: all but the attitude times a factor."""
    q = s.q * factor
    q[3:7] = s.q[3:7]
    return replace(s, q=q, v=s.v * factor, v_dot=s.v_dot * factor, tau=s.tau * factor, f_ext=s.f_ext * factor)


# Outputs


def judged(model: Model) -> list[str]:
    """Return the functions of a state alone; those of contact and implicit steps take more."""
    made, known = model.manifest["functions"], {"accelerations", *(field.name for field in fields(State))}
    return [name for name in model.kernels if known.issuperset(a["name"] for a in made[name]["inputs"])]


def outputs(model: Model, name: str, state: State) -> dict[str, np.ndarray]:
    """Return the outputs of a function at a state, by name."""
    return named(model, name, model.kernel(name)(*arguments(model, name, state)))


def named(model: Model, name: str, result) -> dict[str, np.ndarray]:
    """Return what a function returned by the names of its outputs."""
    results = result if isinstance(result, tuple) else (result,)
    return dict(zip((a["name"] for a in model.manifest["functions"][name]["outputs"]), results, strict=True))


def arguments(model: Model, name: str, state: State) -> list[np.ndarray]:
    """Return the inputs of a function at a state."""
    return [getattr(state, a["name"]) for a in model.manifest["functions"][name]["inputs"]]


def casadi_outputs(model: Model, name: str, function, state: State, *more) -> list[np.ndarray]:
    """Return the outputs of a CasADi function at a state, shaped as the model's."""
    results = function(*arguments(model, name, state), *more)
    shapes = [a["shape"] for a in model.manifest["functions"][name]["outputs"]]
    results = results if isinstance(results, tuple) else (results,)
    return [np.array(x).reshape([] if shape == [1] else shape) for x, shape in zip(results, shapes, strict=True)]


def differences(model: Model, name: str, state: State, references) -> float:
    """Return the largest error of a function's outputs against references, in order; what is solved for, by cond(H)."""
    found = outputs(model, name, state).items()
    pairs = [(key, x, reference) for (key, x), reference in zip(found, references, strict=True)]
    solved = name.startswith("forward_dynamics_") and name in DERIVATIVES
    return worst(
        relative(x, reference, max(size, np.max(np.abs(reference))))
        if (size := cancelled(model, key, state))
        else difference(model, state.q, key, x, reference)
        for key, x, reference in pairs
    ) / (sensitivity(model, state.q) if solved else 1.0)


def cancelled(model: Model, output: str, state: State) -> float:
    """Return the size of what the whole animal's translation adds to a derivative, which cancels in its turns, or 0."""
    speed, weights = (np.linalg.norm(x[:3]) for x in (state.v, state.multiplier))
    load = np.linalg.norm(state.v_dot[:3]) + model.parameters["gravity"]
    sizes = {"kinetic_dq": speed**2, "qq": load * weights, "aq": weights}
    return total_mass(model) * sizes.get(output, 0.0)


def same_bits(model: Model, names, state: State, other: State) -> dict[str, float]:
    """Return by function how many outputs differ between two states."""
    return {name: differing_outputs(outputs(model, name, state), outputs(model, name, other)) for name in names}


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
    """Return the condition number that an error of v_dot is divided by; of its tail's part where H is missing.

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
        height = abs(q[2]) + model.parameters["tail_length"] + np.linalg.norm(model.parameters["tail_mount"])
        return relative(x, reference, total_mass(model) * model.parameters["gravity"] * height)
    return relative(x, reference)


def differing(x, other) -> float:
    """Return how many numbers differ in some bit; a zero has no sign."""
    x, other = (np.ascontiguousarray(y) + 0.0 for y in (x, other))
    if (x.shape, x.dtype) != (other.shape, other.dtype):
        return np.inf
    bits = f"u{x.dtype.itemsize}"
    return float(np.sum(x.view(bits) != other.view(bits)))

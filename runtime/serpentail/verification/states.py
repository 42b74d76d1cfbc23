"""Seeded random states of a model, and its outputs there."""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from ..errors import ModelError
from ..model.model import Model

KINDS = ("random", "straight", "folded")


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


def states(model: Model, count: int = 4, seed: int = 1) -> Iterator[State]:
    """Yield ``count`` states of each kind, every number exact in the model's real type; ModelError
    for polar angles.
    """
    if model.manifest["scene"]["coordinates"] == "polar":
        remedy = 'verify the same scene with coordinates = "bend"'
        raise ModelError(
            f"{model.name}: polar coordinates lose digits and have no straight tail: {remedy}"
        )
    torque = (
        10 * model.parameters["tail_mass"] * model.parameters["tail_length"] ** 2
    )  # at 10 rad/s^2
    rng, real = np.random.default_rng(seed), model.parameter_vector.dtype
    for kind in KINDS:
        for k in range(count):
            q = np.concatenate(
                [rng.uniform(-1, 1, 3), direction(rng, 4), tail_angles(model, rng, kind, k)]
            )
            v, v_dot = (blocks(rng, model.nv, s) for s in ((2.0, 20.0, 10.0), (20.0, 500.0, 500.0)))
            tau = rng.uniform(-torque, torque, model.nv - 6)
            f_ext = total_mass(model) * rng.uniform(
                -1, 1, len(model.external_force())
            )  # at 1 m/s^2
            f_ext[3:6] *= model.parameters["tail_length"]
            directions = [rng.uniform(-1, 1, len(x)) for x in (v, v, tau, v)]
            yield State(
                kind,
                *(x.astype(real).astype(float) for x in (q, v, v_dot, tau, f_ext, *directions)),
            )


def total_mass(model: Model) -> float:
    """Return the mass of torso and tail (kg)."""
    return model.parameters["torso_mass"] + model.parameters["tail_mass"]


def direction(rng, size: int) -> np.ndarray:
    """Return a unit vector, uniform over all directions; of size 4 a quaternion, uniform over the
    rotations.
    """
    vector = rng.normal(size=size)
    return vector / np.linalg.norm(vector)


def tail_angles(model: Model, rng, kind: str, k: int) -> np.ndarray:
    """Return no bend; bends of up to 1 rad; or, in turn, joints within 0.01 rad of +-pi and within
    two turns.

    The bends of a continuum keep within its range, also where a law moves on from the state.
    """
    size, reach = model.nv - 6, model.manifest["scene"].get("bend_range", np.inf)
    if kind == "straight":
        return np.zeros(size)
    if kind == "random":
        return rng.uniform(-1, 1, size) * min(1, reach / 4)
    if model.manifest["scene"]["kind"] == "continuum":
        return np.concatenate(
            [rng.uniform(0.3, 0.6) * reach * direction(rng, 2) for _ in range(size // 2)]
        )
    near_pi = rng.choice([-np.pi, np.pi], size) + rng.uniform(-0.01, 0.01, size)
    return near_pi if k % 2 == 0 else rng.uniform(-2 * np.pi, 2 * np.pi, size)


def blocks(rng, nv: int, scales: tuple[float, float, float]) -> np.ndarray:
    """Return a vector like v, each block uniform within its own scale."""
    return np.concatenate(
        [rng.uniform(-s, s, size) for s, size in zip(scales, (3, 3, nv - 6), strict=True)]
    )


def scaled(s: State, factor: float) -> State:
    """Return another state: all but the attitude times a factor."""
    q = s.q * factor
    q[3:7] = s.q[3:7]
    return replace(
        s, q=q, v=s.v * factor, v_dot=s.v_dot * factor, tau=s.tau * factor, f_ext=s.f_ext * factor
    )


# Outputs


def judged(model: Model) -> list[str]:
    """Return the functions of a state alone; those of contact and implicit steps take more."""
    made, known = (
        model.manifest["functions"],
        {"accelerations", *(field.name for field in fields(State))},
    )
    return [
        name for name in model.kernels if known.issuperset(a["name"] for a in made[name]["inputs"])
    ]


def outputs(model: Model, name: str, state: State) -> dict[str, np.ndarray]:
    """Return the outputs of a function at a state, by name."""
    return named(model, name, model.kernel(name)(*arguments(model, name, state)))


def named(model: Model, name: str, result) -> dict[str, np.ndarray]:
    """Return what a function returned by the names of its outputs."""
    results = result if isinstance(result, tuple) else (result,)
    return dict(
        zip((a["name"] for a in model.manifest["functions"][name]["outputs"]), results, strict=True)
    )


def arguments(model: Model, name: str, state: State) -> list[np.ndarray]:
    """Return the inputs of a function at a state."""
    return [getattr(state, a["name"]) for a in model.manifest["functions"][name]["inputs"]]


def casadi_outputs(model: Model, name: str, function, state: State, *more) -> list[np.ndarray]:
    """Return the outputs of a CasADi function at a state, shaped as the model's."""
    results = function(*arguments(model, name, state), *more)
    shapes = [a["shape"] for a in model.manifest["functions"][name]["outputs"]]
    results = results if isinstance(results, tuple) else (results,)
    return [
        np.array(x).reshape([] if shape == [1] else shape)
        for x, shape in zip(results, shapes, strict=True)
    ]

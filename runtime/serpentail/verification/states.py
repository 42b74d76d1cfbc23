"""The states at which laws are checked, seeded and random, and a model's outputs there."""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TAIL_V
from serpentail_scene.signatures.signature import SIMULATION
from serpentail_scene.signatures.table import in_group

from ..basics.errors import ModelError
from ..model.chains import bend_ranges
from ..model.model import Model
from ..model.weight import total_mass

KINDS = ("random", "straight", "folded")


@dataclass(frozen=True)
class Case:
    """A state of a model at which laws are checked: all arguments that its functions take."""

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
    drift: np.ndarray  # in air, velocity of B against it and omega, torso axes
    tension: np.ndarray  # of the tendons (N)

    @property
    def fixed(self) -> bool:
        """Whether the base is fixed; else the quaternion has one number more than its rates."""
        return len(self.q) == len(self.v)

    @property
    def accelerations(self) -> np.ndarray:
        """Wanted accelerations of the tail coordinates."""
        return self.v_dot[-len(self.tau) :]

    @property
    def x(self) -> np.ndarray:
        """The airborne state: quaternion, tail coordinates, their rates, and the drift in air."""
        return np.concatenate([self.q[QUATERNION], self.q[TAIL_Q], self.v[TAIL_V], self.drift])

    @property
    def angular(self) -> np.ndarray:
        """An angular momentum (kg m^2/s, world): the loads' moment, for 0.05 s."""
        return self.f_ext[OMEGA] / 20

    @property
    def weights(self) -> np.ndarray:
        """Weights of an airborne state's rates and of omega."""
        return np.resize(self.multiplier, len(self.x) + 3)


def states(model: Model, count: int = 4, seed: int = 1) -> Iterator[Case]:
    """Yield states of each kind, exact in the model's real type; ModelError if it is polar."""
    if model.manifest["scene"]["coordinates"] == "polar":
        remedy = 'verify the same scene with coordinates = "bend"'
        raise ModelError(
            f"{model.name}: polar coordinates lose digits and have no straight tail: {remedy}"
        )
    rng, real = np.random.default_rng(seed), model.parameter_vector.dtype
    for kind in KINDS:
        for k in range(count):
            arrays = random_arrays(model, rng, kind, k)
            yield Case(kind, *(x.astype(real).astype(float) for x in arrays))


def random_arrays(model: Model, rng: np.random.Generator, kind: str, k: int) -> list[np.ndarray]:
    """Return the numbers of state k of its kind, in the order of a Case's."""
    tail, length = model.layout.nt, model.parameters["tail_length"]

    # where it is, and how it moves
    place, attitude = rng.uniform(-1, 1, 3), direction(rng, 4)
    q = np.concatenate([place, attitude, tail_angles(model, rng, kind, k)])
    v = blocks(rng, tail, (2.0, 20.0, 10.0))
    v_dot = blocks(rng, tail, (20.0, 500.0, 500.0))

    # torques for 10 rad/s^2, loads for 1 m/s^2
    torque = 10 * model.parameters["tail_mass"] * length**2
    tau = rng.uniform(-torque, torque, tail)
    f_ext = total_mass(model.parameters) * rng.uniform(-1, 1, len(model.external_force()))
    f_ext[OMEGA] *= length
    if model.fixed:
        q, v, v_dot = (x[-tail:] for x in (q, v, v_dot))

    # directions of derivatives
    directions = [rng.uniform(-1, 1, len(x)) for x in (v, v, tau, v)]
    flies = "air_density" in model.parameters and not model.fixed
    drift = blocks(rng, 0, (2.0, 20.0, 0.0)) if flies else np.zeros(0)
    tension = np.abs(np.resize(directions[-1], len(model.layout.tendons)))
    return [q, v, v_dot, tau, f_ext, *directions, drift, tension]


def direction(rng: np.random.Generator, size: int) -> np.ndarray:
    """Return a unit vector, uniform over all directions; of size 4, uniform over all rotations."""
    vector = rng.normal(size=size)
    return vector / np.linalg.norm(vector)


def tail_angles(model: Model, rng: np.random.Generator, kind: str, k: int) -> np.ndarray:
    """Return the tail of state k: straight, with random bends of up to 1 rad, or folded.

    Folded joints are, in turn, within 0.01 rad of +-pi and within two turns. The bends of a
    continuum stay within its range, also where a law moves on from the state.
    """
    size, widths = model.layout.nt, model.layout.widths
    reach = bend_ranges(model.manifest)
    if kind == "straight":
        return np.zeros(size)
    if kind == "random":
        return rng.uniform(-1, 1, size) * np.repeat(np.minimum(1, reach / 4), widths)
    bent, turned = np.zeros(size), np.zeros(size)
    if "continuum" in model.kinds:
        bends = [rng.uniform(0.3, 0.6) * most * direction(rng, 2) for most in reach]
        bent = np.concatenate([bend[:n] for bend, n in zip(bends, widths, strict=True)])
    if {*model.kinds} != {"continuum"}:
        near_pi = rng.choice([-np.pi, np.pi], size) + rng.uniform(-0.01, 0.01, size)
        turned = near_pi if k % 2 == 0 else rng.uniform(-2 * np.pi, 2 * np.pi, size)
    return np.where(np.repeat(model.kinds, widths) == "continuum", bent, turned)


def blocks(rng: np.random.Generator, tail: int, scales: tuple[float, float, float]) -> np.ndarray:
    """Return a vector like v, each block uniform within its own scale."""
    sizes = (3, 3, tail)
    return np.concatenate([rng.uniform(-s, s, n) for s, n in zip(scales, sizes, strict=True)])


def at_origin(s: Case) -> Case:
    """Return the state with B at the origin."""
    q = s.q.copy()
    if not s.fixed:
        q[POSITION] = 0
    return replace(s, q=q)


def scaled(s: Case, factor: float) -> Case:
    """Return another state: all but the attitude times a factor."""
    q = s.q * factor
    if not s.fixed:
        q[QUATERNION] = s.q[QUATERNION]
    return replace(
        s, q=q, v=s.v * factor, v_dot=s.v_dot * factor, tau=s.tau * factor, f_ext=s.f_ext * factor
    )


# Outputs


def functions_of(model: Model, airborne: bool = False) -> list[str]:
    """Return the functions of a state alone, or of an airborne one, too.

    Those of contact and of implicit steps take more arguments, and simulations have their own.
    """
    known = {"accelerations", *(field.name for field in fields(Case))}
    known |= {*vars(Case)} if airborne else set()
    functions = model.manifest["functions"]
    names = [name for name in model.kernels if name not in in_group(SIMULATION)]
    return [name for name in names if {a["name"] for a in functions[name]["inputs"]} <= known]


def outputs(model: Model, name: str, state: Case) -> dict[str, np.ndarray]:
    """Return the outputs of a function at a state, by name."""
    return named(model, name, model.kernel(name)(*arguments(model, name, state)))


def named(model: Model, name: str, result: Any) -> dict[str, np.ndarray]:
    """Return the results of a function by the names of its outputs."""
    results = result if isinstance(result, tuple) else (result,)
    names = [a["name"] for a in model.manifest["functions"][name]["outputs"]]
    return dict(zip(names, results, strict=True))


def arguments(model: Model, name: str, state: Case) -> list[np.ndarray]:
    """Return the inputs of a function at a state."""
    return [getattr(state, a["name"]) for a in model.manifest["functions"][name]["inputs"]]


def casadi_outputs(
    model: Model, name: str, function: Any, state: Case, *more: Any
) -> list[np.ndarray]:
    """Return the outputs of a CasADi function at a state, shaped as the model's."""
    results = function(*arguments(model, name, state), *more)
    shapes = [a["shape"] for a in model.manifest["functions"][name]["outputs"]]
    results = results if isinstance(results, tuple) else (results,)
    return [
        np.array(x).reshape([] if shape == [1] else shape)
        for x, shape in zip(results, shapes, strict=True)
    ]

"""The models of the stress test, each with its exact reference."""

import ctypes
import tempfile
import warnings
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import serpentail as st
from checks.stress.figure import Figure
from serpentail.compiling.toolchain import examine, run_command
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import (
    block_error,
    equilibrated_condition,
    force_error,
    mass_matrix_error,
)
from tests.support.models import model_folder

FUNCTIONS = ["mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics", "energy"]
FUNCTIONS += ["momentum", "tail_points", "inverse_dynamics_derivatives", "rollout"]
DIGITS, NODES = 30, 20
EPS = float(np.finfo(float).eps)
PER_CONDITION = 5e-15  # of v_dot, over the condition number of H with a unit diagonal
SUM = "double sum(double a, double b, double c) { return a * b + c; }\n"


@dataclass(frozen=True, eq=False)
class Subject:
    """A model, and the same equations of motion to 40 digits."""

    name: str
    model: st.Model
    exact: object

    @property
    def links(self) -> int:
        """All links of the tail, or the segments of a continuum."""
        return self.model.segments * (self.model.links or 1)

    @property
    def limit(self) -> float:
        """Rounding of H, in the units of its diagonal: what one body adds, and a little for each of
        a long chain.
        """
        return EPS * (64 + self.links) * roundings()

    @property
    def solved_limit(self) -> float:
        """Error of v_dot over cond(H): 5e-15, and more where hundreds of links add up their
        rounding.
        """
        return PER_CONDITION * (1 + self.links / 256) * roundings()


@cache
def roundings() -> int:
    """Return how many roundings a * b + c has in compiled models: 1 if it is fused, else 2.

    It is fused by optimising compilers for processors that can; `-O0` never fuses it.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compiler = examine("fast", folder)
        (folder / "sum.c").write_text(SUM)
        files = str(folder / "sum.c"), "-o", str(folder / "sum.so")
        run_command((*compiler.command, *compiler.flags, "-shared", "-fPIC", *files))
        function = ctypes.CDLL(folder / "sum.so").sum
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * 3
    return 1 if function(1 + 2**-30, 1 - 2**-30, -1) else 2  # the product alone rounds to 1


@dataclass(frozen=True)
class Errors:
    """Errors at one state, without units: of H, C and v_dot, and the condition number of H with a
    unit diagonal.
    """

    H: float
    C: float
    v_dot: float
    condition: float
    refused: str = ""

    @property
    def per_condition(self) -> float:
        """Error of v_dot over cond(H)."""
        return self.v_dot / self.condition


@cache
def subject(segments: int, links: int | None, real: str = "double") -> Subject:
    """Return a subject with the paper's parameters; without links a continuum."""
    model = st.load(model_folder(segments, links, functions=FUNCTIONS, real=real))
    return Subject(label(segments, links), model, exact_of(model))


def label(segments: int, links: int | None) -> str:
    """Return a tail's name in a report."""
    return f"({segments}, {links})" if links else f"continuum {segments}"


def exact_of(model: st.Model):
    """Return the reference with a model's parameters."""
    if model.links:
        return ExactChain(model.parameters, model.segments, model.links, DIGITS)
    return ExactContinuum(model.parameters, model.segments, DIGITS, NODES)


def changed(of: Subject, **parameters) -> Subject:
    """Return a subject with other parameters, without warnings about unlike sizes."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.UnlikeBodies)
        warnings.simplefilter("ignore", st.UnusualSize)
        model = of.model.with_parameters(**parameters)
    return Subject(f"{of.name} {', '.join(parameters)}", model, exact_of(model))


def state(
    of: Subject, rng, bends: np.ndarray, speeds=(2.0, 20.0, 10.0)
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, v, tau with these tail coordinates, everything else at random."""
    quaternion = rng.normal(size=4)
    q = np.concatenate([rng.uniform(-1, 1, 3), quaternion / np.linalg.norm(quaternion), bends])
    sizes = (3, 3, len(bends))
    v = np.concatenate([rng.uniform(-s, s, size) for s, size in zip(speeds, sizes, strict=True)])
    torque = 10 * of.model.parameters["tail_mass"] * of.model.parameters["tail_length"] ** 2
    return q, v, rng.uniform(-torque, torque, len(bends))


def errors(of: Subject, q, v, tau) -> Errors:
    """Return a model's errors at a state; a refusal is reported, but is not an error."""
    H = of.exact.mass_matrix(q)
    condition = equilibrated_condition(H)
    try:
        of_H = mass_matrix_error(of.model.mass_matrix(q), H)
        of_C = force_error(of.model.bias_force(q, v), of.exact.bias_force(q, v), H)
        v_dot = of.model.forward_dynamics(q, v, tau)
    except st.StateError as refusal:
        return Errors(0.0, 0.0, 0.0, condition, str(refusal))
    return Errors(of_H, of_C, block_error(v_dot, of.exact.forward_dynamics(q, v, tau)), condition)


def compared(of: Subject, what: str, found: list[Errors], disparity: float = 1.0) -> list[Figure]:
    """Return the largest errors of H, C and v_dot over cond(H) of some states; a disparity of
    moments widens limits.
    """
    worst = max(found, key=lambda e: e.per_condition)
    condition = f"cond(H) {worst.condition:.2g}"
    refused = [e.refused for e in found if e.refused]
    note = f"{len(refused)} of {len(found)} refused: {refused[0]}" if refused else ""
    limit, solved, name = of.limit * disparity, of.solved_limit * disparity, f"{of.name}, {what}"
    return [
        Figure(f"{name}: H", max(e.H for e in found), limit, note),
        Figure(f"{name}: C", max(e.C for e in found), limit),
        Figure(f"{name}: v_dot / cond(H)", worst.per_condition, solved, condition),
    ]

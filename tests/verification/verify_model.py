"""`make verify`: the laws, and the model against other derivations of it, in one report.

The others are the generator's interpreter, Pinocchio, arithmetic of 40 digits and the same tail in
other segments.
"""

import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np

import serpentail as st
from serpentail.verification.errors import block_error, differences, matrix_error
from serpentail.verification.law import VALUE_LIMIT, Law, rid_of
from serpentail.verification.report import Check, as_short_text, as_text, check, laws, summary
from serpentail.verification.states import Case, arguments, outputs, states
from serpentail_codegen.functions.catalogue import CATALOGUE, function_of
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.pipeline import generate, tail_of
from serpentail_codegen.scene.parse import parse_scene
from serpentail_scene.layout import TAIL_Q, TAIL_V, TORSO_NQ
from serpentail_scene.parameters import PARTS, PASSIVE_NAMES
from serpentail_scene.signatures.signature import CONTACT, IMPLICIT, SIMULATION
from serpentail_scene.signatures.table import in_group

STRICT_LIMIT = 22.5  # roundings: 5e-15 in double
# what H sums cancels in a folded tail: libraries are off by 1e-14 to 2e-14 there
FOLDED_LIMIT = 4 * STRICT_LIMIT
COMPARED = (
    "mass_matrix",
    "bias_force",
    "inverse_dynamics",
    "forward_dynamics",
    "energy",
    "momentum",
    "center_of_mass",
)
PLAIN = "only for equal segments without rotors and air on a torso that moves, on level ground"
POINTS = ("tail_points", "tail_point_jacobians")


@dataclass(frozen=True)
class Reference:
    """Another derivation of one kind of tail: its maker, what it computes, and if exactly."""

    title: str
    module: str
    chain: str
    kind: str
    names: tuple[str, ...] = COMPARED
    exact: bool = False

    def opened(self, model: st.Model):
        """Return the reference for a model's tail; ImportError, or ValueError where it refuses."""
        if not plain(model):
            raise ValueError(PLAIN)
        chain = getattr(import_module(f"tests.references.{self.module}"), self.chain)
        sizes = (model.segments, model.links) if self.kind == "articulated" else (model.segments,)
        return chain(parameters(model), *sizes)

    def rows(
        self, model: st.Model, cases: list[Case]
    ) -> Iterator[tuple[str, str, list[Case], float]]:
        """Yield title, function, states and limit (in roundings) of every comparison."""
        # libraries are off by 6e-13 for 48 links, folded, by 9e-12 for 128
        long = 2 * model.segments * (model.links or 1)
        for name in self.names:
            if not (self.exact and name == "forward_dynamics"):
                yield name, name, cases, VALUE_LIMIT if self.exact else VALUE_LIMIT * max(10, long)
                continue
            yield name, name, [s for s in cases if s.kind != "folded"], STRICT_LIMIT
            yield f"{name}, folded", name, [s for s in cases if s.kind == "folded"], FOLDED_LIMIT


def plain(model: st.Model) -> bool:
    """Tell if segments are equal, on a torso that moves: what the references know."""
    more = {"gravity_vector", "tail_rotor", "air_density"} & model.parameters.keys()
    return isinstance(model.manifest["scene"]["segments"], int) and not model.fixed and not more


REFERENCES = (
    Reference("Pinocchio", "pinocchio_tree", "chain", "articulated", (*COMPARED, *POINTS)),
    Reference("40 digits", "exact_chain", "ExactChain", "articulated", exact=True),
    Reference("40 digits", "exact_continuum", "ExactContinuum", "continuum", exact=True),
)


def verify(folder: str | Path) -> list[Check]:
    """Return every check of a generated folder's model."""
    return judge(st.load(folder))


def judge(model: st.Model) -> list[Check]:
    """Return every check of a model."""
    cases = list(states(model))
    one_of_each = list({s.kind: s for s in reversed(cases)}.values())
    checks = laws(model)
    checks += [check(entry, model, one_of_each) for entry in interpreter_laws(model)]
    # other derivations know no springs, damping or stops: laws check these
    bare = rid_of(model, PARTS)
    for reference in REFERENCES:
        checks += reference_checks(reference, bare, cases)
    with tempfile.TemporaryDirectory() as parent:
        return [*checks, split_check(bare, cases, Path(parent))]


# The interpreter: what the program means, by the numbers of Python


def interpreter_laws(model: st.Model) -> Iterator[Law]:
    """Yield, for every function, that the C gives what its program means."""
    text = "The C gives what the interpreter of its program gives."
    for name in CATALOGUE:
        # these take more than a state
        if name in (*in_group(CONTACT), *in_group(IMPLICIT), *in_group(SIMULATION)):
            continue
        yield Law(f"interpreter: {name}", text, interpreted(model, name), (name,), VALUE_LIMIT)


def interpreted(model: st.Model, name: str) -> Callable:
    """Return the law's error: the C against the program, run on Python's floats."""
    scene = parse_scene(model.manifest["scene"], model.name)
    assembled = cache(lambda: assemble(function_of(name, tail_of(scene)), tail_of(scene)))

    def error(model: st.Model, s: Case) -> float:
        arrays = assembled().of_role("input")
        inputs = {a.name: getattr(s, a.name).tolist() for a in arrays}
        inputs |= {key: np.ravel(value).tolist() for key, value in parameters(model).items()}
        values = Run(assembled(), Numbers(), inputs).values
        shapes = {key: x.shape for key, x in outputs(model, name, s).items()}
        references = [np.reshape(values[key], shape) for key, shape in shapes.items()]
        return differences(model, name, s, references)

    return error


def parameters(model: st.Model) -> dict:
    """Return the parameters as the model's real type holds them."""
    real = model.parameter_vector.dtype
    return {
        name: np.asarray(value, real).astype(float).tolist()
        for name, value in model.parameters.items()
    }


# References: other derivations of the same tail


def reference_checks(reference: Reference, model: st.Model, cases: list[Case]) -> list[Check]:
    """Return a check of every quantity that a reference computes; none for another kind of tail."""
    title, checks = reference.title, []
    text = f"The model agrees with {title}, v_dot relative to cond(H)."
    if reference.kind != model.manifest["scene"]["kind"]:
        return []
    try:
        chain = reference.opened(model)
    except (ImportError, ValueError) as error:
        return [Check(f"{title}: chain", text, 0.0, 0.0, omitted=str(error))]
    for row, name, chosen, units in reference.rows(model, cases):
        entry = Law(f"{title}: {row}", text, agreement(chain, name), (name,), units)
        checks.append(check(entry, model, chosen))
    return checks


def agreement(chain, name: str) -> Callable:
    """Return the law's error: a function of the model against the same of a chain."""

    def error(model: st.Model, s: Case) -> float:
        results = getattr(chain, name)(*arguments(model, name, s))
        return differences(model, name, s, results if isinstance(results, tuple) else (results,))

    return error


# Equal segments: 2 m segments of n links that bend alike are m segments of 2 n


def split_check(model: st.Model, cases: list[Case], parent: Path) -> Check:
    """Return whether H and C depend on how equal joints are counted, by a model made for this."""
    name = "halves of segments"
    text = (
        "With equal halves, 2 m segments of n links are m segments of 2 n: H = G^T H G, C = G^T C, "
        "G repeating angles."
    )
    functions = ["mass_matrix", "bias_force"]
    if not plain(model):
        return Check(name, text, 0.0, 0.0, omitted=PLAIN)
    sizes = partner_sizes(model)
    if sizes is None:
        return Check(name, text, 0.0, 0.0, omitted="no even m or n of links")
    if not set(functions) <= set(model.kernels):
        return Check(name, text, 0.0, 0.0, omitted=f"not generated: {' or '.join(functions)}")
    change = {"segments": sizes[0], "links": sizes[1], "functions": functions, "name": "partner"}
    scene = model.manifest["scene"]
    change["parameters"] = {n: x for n, x in scene["parameters"].items() if n not in PASSIVE_NAMES}
    generate(parse_scene(scene | change, "partner"), parent)
    partner = st.load(parent / "partner")
    whole, halves = (model, partner) if partner.segments > model.segments else (partner, model)

    def error(_model: st.Model, s: Case) -> dict[str, float]:
        return split_errors(whole, halves, s)

    return check(Law(name, text, error, units=VALUE_LIMIT), model, cases)


def partner_sizes(model: st.Model) -> tuple[int, int] | None:
    """Return the sizes of the same articulated tail in half or twice as many segments."""
    segments, links = model.segments, model.links
    if model.manifest["scene"]["kind"] != "articulated" or segments % 2 == links % 2 == 1:
        return None
    return (segments // 2, 2 * links) if segments % 2 == 0 else (2 * segments, links // 2)


def split_errors(whole: st.Model, halves: st.Model, s: Case) -> dict[str, float]:
    """Return the errors of H and C at the state of the whole that the state begins with."""
    q, v = s.q[: whole.nq], s.v[: whole.nv]
    G = np.kron(np.eye(whole.segments), np.vstack([np.eye(2), np.eye(2)]))
    T = np.eye(halves.nv, whole.nv)
    T[TAIL_V, TAIL_V] = G
    q_halves, v_halves = np.concatenate([q[:TORSO_NQ], G @ q[TAIL_Q]]), T @ v
    return {
        "H": matrix_error(T.T @ halves.mass_matrix(q_halves) @ T, whole.mass_matrix(q)),
        "C": block_error(T.T @ halves.bias_force(q_halves, v_halves), whole.bias_force(q, v)),
    }


def report(folder: Path, output: Path) -> int:
    """Verify a folder, write the reports, print a short table; 1 if a check failed."""
    try:
        checks, model = verify(folder), st.load(folder)
    except st.SerpentailError as error:
        print(error, file=sys.stderr)
        return 2
    output.mkdir(parents=True, exist_ok=True)
    path = output / f"{model.name}.txt"
    path.write_text(as_text(model, checks) + "\n")
    path.with_suffix(".json").write_text(json.dumps(summary(model, checks), indent=1) + "\n")
    print(as_short_text(model, checks))
    print(f"  report: {path}")
    return 0 if all(c.passed for c in checks) else 1

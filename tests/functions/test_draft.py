"""A draft refuses reads that a step does not declare, that are missing, or that shadow others."""

import pytest

from serpentail_codegen.functions.draft import Draft
from serpentail_codegen.functions.scope import Instead, Vectors
from serpentail_codegen.functions.tail import Tail, struct_parameters
from serpentail_codegen.ir.program import Apply, statements
from serpentail_codegen.mechanics import contact, rotations, torso
from serpentail_codegen.mechanics.lower import derive
from serpentail_codegen.mechanics.shapes import M33, V3
from tests.support.rows import row


def draft_with(**sizes):
    """A draft of a function of a small tail on the ground, and local vectors."""
    draft = Draft("drafted", "A draft.", tail=Tail(1, 1, contacts=("feet",)))
    draft.declare_parameters(struct_parameters(draft.tail))
    return draft, {name: draft.vector(name, size) for name, size in sizes.items()}


def applied(draft):
    """What the only step of a draft reads and writes, by the names of the arrays."""
    (statement,) = (s for s, *_ in statements(draft.finish().body) if isinstance(s, Apply))
    return {name: ref.array.name for name, ref in statement.inputs().items()}


def test_parameters_are_found_by_their_names_and_all_else_is_passed():
    """A step takes from a scope what it declares, and what stands for a parameter says so."""
    step = rotations.world_acceleration
    for scope, names in ((dict, "Ra"), (Vectors, "Raw")):
        draft, given = draft_with(R=9, a=3, w=3, p_ddot=3)
        reads = scope({name: given[name] for name in names})
        draft.step(step, reads, p_ddot=given["p_ddot"])
        assert applied(draft) == {"R": "R", "gravity": "gravity", "a": "a"}
    draft, given = draft_with(R=9, a=3, p_ddot=3)
    reads, weightless = {name: given[name] for name in "Ra"}, draft.zero(1)
    draft.step(step, reads, Instead({"gravity": weightless}), p_ddot=given["p_ddot"])
    assert applied(draft)["gravity"] == "zero_1"
    # what only an output needs that is not wanted may be missing
    draft, given = draft_with(a=3, force=3, F_next=6)
    force = given.pop("force")
    draft.step(torso.torso_wrench, given, force=force)
    assert set(applied(draft)) == {"torso_mass", "a", "F_next"}


def forward_dynamics(let, R: M33, a: V3) -> dict:
    """A step whose name the CasADi module would define twice."""
    return {"p_ddot": R * a}


def test_wrong_reads_and_writes_are_refused():
    draft, given = draft_with(R=9, a=3, w=3, p_ddot=3, other=3)
    p_ddot, R, a = (given[name] for name in ("p_ddot", "R", "a"))
    right = {"R": R, "a": a}
    acceleration = rotations.world_acceleration
    for words, step, *reads in (
        ("world_acceleration in drafted.* w", acceleration, right | {"w": given["w"]}),
        ("world_acceleration.* in drafted.* a", acceleration, {"R": R}),
        ("forward_dynamics in drafted", forward_dynamics, right),
        ("drafted: a is no parameter", acceleration, {"R": R}, Instead({"a": a})),
        ("drafted: a is given twice", acceleration, right, Vectors({"a": given["other"]})),
    ):
        with row(words), pytest.raises(ValueError, match=words):
            draft.step(step, *reads, p_ddot=p_ddot)
    with pytest.raises(ValueError, match=r"vector.*tail_mount"):
        mount = draft.parameters["tail_mount"]
        draft.step(rotations.world_vector, {"R": R, "vector": a}, vector=mount)
    with pytest.raises(TypeError):
        draft.parameters["tail_mount"] = a


@pytest.mark.parametrize("kind", [dict, Vectors])
def test_no_read_shadows_a_parameter(kind):
    """A work array called ``mu`` once stood for the coefficient of friction."""
    sizes = {"drag": 1, "mobility": 1, "p": 3, "arm": 3, "bristle": 2, "velocity": 3}
    draft, reads = draft_with(**sizes)
    law = derive(contact.contact_force, friction="cone")
    writes = {name: draft.vector(name, size) for name, size in (("force", 3), ("rate", 2))}
    with pytest.raises(ValueError, match=r"contact_force_.* in drafted: mu"):
        draft.step(law, kind(reads | {"mu": draft.vector("response", 1)}), **writes)
    draft.step(law, kind(reads), **writes)
    assert applied(draft)["mu"] == "mu"


def test_a_constant_is_declared_once():
    draft, _ = draft_with()
    assert draft.fixed("share", [1, 2]) == draft.fixed("share", [1, 2])
    with pytest.raises(ValueError, match=r"share.*drafted"):
        draft.fixed("share", [1, 3])


def test_without_a_velocity_there_is_no_rate():
    draft, _ = draft_with()
    state = draft.state(draft.array("q", draft.tail.nq))
    assert state.angles(0).size == 2
    for read in (lambda: state.rates(0), lambda: state.omega, lambda: state.torso(state.q[0])):
        with pytest.raises(ValueError, match="no v "):
            read()

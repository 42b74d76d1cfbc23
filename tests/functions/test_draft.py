"""A draft refuses reads that a step does not declare, that are missing, or that shadow others."""

import pytest

from serpentail_codegen.functions.draft import Draft
from serpentail_codegen.functions.scope import Instead, State, Vectors
from serpentail_codegen.functions.tail import Tail, struct_parameters
from serpentail_codegen.ir.program import Apply, statements
from serpentail_codegen.mechanics import contact, rotations, torso
from serpentail_codegen.mechanics.lower import derive
from serpentail_codegen.mechanics.shapes import M33, V3


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
    draft, given = draft_with(R=9, a=3, p_ddot=3)
    p_ddot = given.pop("p_ddot")
    draft.step(rotations.world_acceleration, given, p_ddot=p_ddot)
    assert applied(draft) == {"R": "R", "gravity": "gravity", "a": "a"}


def test_a_step_takes_from_a_scope_what_it_declares():
    draft, given = draft_with(R=9, a=3, w=3, p_ddot=3)
    p_ddot = given.pop("p_ddot")
    draft.step(rotations.world_acceleration, Vectors(given), p_ddot=p_ddot)
    assert set(applied(draft)) == {"R", "gravity", "a"}


def test_a_read_that_is_not_declared_is_refused():
    draft, given = draft_with(R=9, a=3, w=3, p_ddot=3)
    p_ddot = given.pop("p_ddot")
    with pytest.raises(ValueError, match="world_acceleration in drafted: it does not read w"):
        draft.step(rotations.world_acceleration, given, p_ddot=p_ddot)


def test_a_read_that_is_missing_is_refused():
    draft, given = draft_with(R=9, p_ddot=3)
    with pytest.raises(ValueError, match=r"world_acceleration.* in drafted: nothing gives a"):
        draft.step(rotations.world_acceleration, {"R": given["R"]}, p_ddot=given["p_ddot"])


def test_a_step_with_the_name_of_an_emitted_function_is_refused():
    draft, given = draft_with(R=9, a=3, p_ddot=3)

    def forward_dynamics(let, R: M33, a: V3) -> dict:
        """A step whose name the CasADi module would define twice."""
        return {"p_ddot": R * a}

    p_ddot = given.pop("p_ddot")
    with pytest.raises(ValueError, match=r"forward_dynamics in drafted: .* function: rename it"):
        draft.step(forward_dynamics, given, p_ddot=p_ddot)


def test_what_only_an_unwanted_output_needs_may_be_missing():
    draft, given = draft_with(w=3, w_dot=3, a=3, force=3, F_next=6)
    force = given.pop("force")
    del given["w"], given["w_dot"]
    draft.step(torso.torso_wrench, given, force=force)
    assert set(applied(draft)) == {"torso_mass", "a", "F_next"}


@pytest.mark.parametrize("kind", [dict, Vectors])
def test_no_read_shadows_a_parameter(kind):
    """A work array called ``mu`` once stood for the coefficient of friction."""
    draft, given = draft_with(velocity=3, force=3, rate=2)
    law = derive(contact.contact_force, friction="cone")
    sizes = {"drag": 1, "mobility": 1, "p": 3, "arm": 3, "bristle": 2}
    reads = {name: draft.vector(name, size) for name, size in sizes.items()}
    reads |= {"velocity": given["velocity"], "mu": draft.vector("response", 1)}
    writes = {name: given[name] for name in ("force", "rate")}
    with pytest.raises(ValueError, match=r"contact_force_.* in drafted: mu is a parameter"):
        draft.step(law, kind(reads), **writes)
    del reads["mu"]
    draft.step(law, kind(reads), **writes)
    assert applied(draft)["mu"] == "mu"


def test_what_stands_for_a_parameter_says_so():
    draft, given = draft_with(R=9, a=3, p_ddot=3)
    reads, weightless = {name: given[name] for name in ("R", "a")}, draft.zero(1)
    step = rotations.world_acceleration
    draft.step(step, reads, Instead({"gravity": weightless}), p_ddot=given["p_ddot"])
    assert applied(draft)["gravity"] == "zero_1"
    with pytest.raises(ValueError, match="drafted: a is no parameter"):
        draft.step(step, {"R": given["R"]}, Instead({"a": given["a"]}), p_ddot=given["p_ddot"])


def test_a_name_is_given_once():
    draft, given = draft_with(R=9, a=3, p_ddot=3)
    reads = {name: given[name] for name in ("R", "a")}
    twice = Vectors({"a": draft.vector("other", 3)})
    with pytest.raises(ValueError, match="world_acceleration in drafted: a is given twice"):
        draft.step(rotations.world_acceleration, reads, twice, p_ddot=given["p_ddot"])


def test_nothing_is_assigned_to_a_parameter():
    draft, given = draft_with(R=9, vector=3)
    with pytest.raises(TypeError, match="does not support item assignment"):
        draft.parameters["tail_mount"] = given["vector"]
    with pytest.raises(ValueError, match="vector would overwrite the parameter tail_mount"):
        draft.step(rotations.world_vector, given, vector=draft.parameters["tail_mount"])


def test_a_constant_is_declared_once():
    draft, _ = draft_with()
    assert draft.fixed("share", [1, 2]) == draft.fixed("share", [1, 2])
    with pytest.raises(ValueError, match="array share is declared twice in drafted"):
        draft.fixed("share", [1, 3])


def test_without_a_velocity_there_is_no_rate():
    draft, _ = draft_with()
    state = State(draft.array("q", draft.tail.nq))
    assert state.angles(0).size == 2
    for read in (lambda: state.rates(0), lambda: state.omega, lambda: state.torso(state.q[0])):
        with pytest.raises(ValueError, match="no v among its arguments"):
            read()

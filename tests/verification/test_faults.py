"""Faults of one function: each breaks a law, and each law is broken by one that is there for it."""

import copy
from dataclasses import replace

import numpy as np
import pytest

import serpentail as st
from serpentail.verification import report as verify
from serpentail.verification import states, value_laws
from serpentail.verification.law import fastest, rid_of
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_scene.signatures import gradients
from tests.support import zoo
from tests.support.faults import (
    SLIGHT_FAULT,
    TAKING_MORE,
    broken,
    failed,
    laws_broken,
    not_a_number,
    times,
)
from tests.support.rows import row
from tests.verification import verify_model

NAMED = {entry.name: entry for entry in verify.LAWS}
FREE = [entry for entry in verify.LAWS if not entry.casadi]
# all but what runs alone call: test_rates compares gradients with CasADi's derivatives, test_loads
# runs with forces from outside with forward dynamics
LAWFUL = {*CATALOGUE} - {each.name for each in gradients.SIGNATURES} - {"push_rates"}


def sound(entry):
    """A sound model that a law is about."""
    name = {"passive": "elastic", "contact": "ground", "air": "air", "tendons": "tendons"}.get(
        entry.only, "m1_n3"
    )
    return rid_of(zoo.model(name), entry.without)


def notices(entry, name, change, count=2):
    """Tell if a law fails where a function's result is changed."""
    model, kept = broken(sound(entry), name, change), replace(entry, without=())
    return not verify.check(kept, model, list(states.states(model, count))).passed


def test_every_slight_fault_of_a_function_breaks_the_laws_that_need_it():
    """Unless another fault is there for the law; H scales some laws and runs need others."""
    own, seen = {law for *_, law in FAULTS} | {FLIGHT, PASSIVE}, set()
    for entry in FREE:
        with row(entry.name):
            needs = {*entry.needs} - {"rollout"}
            found = {name for name in needs if notices(entry, name, times(1 + SLIGHT_FAULT))}
            assert entry.name in own or found >= (needs - {"mass_matrix"} or needs) != set()
            seen |= found
    assert seen == LAWFUL


def test_every_function_that_loses_a_number_breaks_a_law():
    for name in LAWFUL:
        with row(name):
            assert any(name in e.needs and notices(e, name, not_a_number, 1) for e in FREE)


def test_every_slight_fault_is_not_what_the_program_means():
    model = zoo.model("m1_n1")
    laws = {entry.name: entry for entry in verify_model.interpreter_laws(model)}
    for name in CATALOGUE:
        if name not in TAKING_MORE:
            with row(name):
                faulty = broken(model, name, times(1 + SLIGHT_FAULT))
                cases = list(states.states(faulty, 1))
                assert not verify.check(laws[f"interpreter: {name}"], faulty, cases).passed


def test_every_slight_fault_disagrees_with_references():
    """Those of all functions together, too: of another animal, which obeys the laws but for those
    of its parameters.
    """
    pytest.importorskip("pinocchio")
    model = zoo.own("m1_n3")
    inertia = [x * (1 + SLIGHT_FAULT) for x in model.parameters["torso_inertia"]]
    other = model.with_parameters(torso_inertia=inertia)
    other.parameters = model.parameters
    assert laws_broken(other) == {"a planar tail turns the torso as bodies at pins"}
    cases = list(states.states(model, 1))
    for reference in verify_model.REFERENCES[:2]:
        for name in reference.names:
            with row(reference.title, name):
                faulty = broken(model, name, times(1 + SLIGHT_FAULT))
                found = failed(verify_model.reference_checks(reference, faulty, cases))
                assert f"{reference.title}: {name}" in found
        found = failed(verify_model.reference_checks(reference, other, cases))
        wanted = {f"{reference.title}: {name}" for name in ("mass_matrix", "forward_dynamics")}
        assert wanted <= found, reference.title


def put(entry, change):
    """A change of one entry of each matrix."""

    def changed(H, *_):
        H[(..., *entry)] = change(H[(..., *entry)])
        return H

    return changed


class Drifting:
    """Differs by one bit from one call to the next."""

    def __init__(self):
        self.calls = 0

    def __call__(self, force, *_):
        self.calls += 1
        return np.nextafter(force, np.inf) if self.calls % 2 else force


def refused(_result, *_):
    """A model that refuses sound states."""
    raise st.StateError("refused")


def batch_only(H, q):
    """Wrong in the last state of a batch."""
    if q.ndim == 2:
        H[-1, 0, 0] *= FACTOR
    return H


def of_one(which):
    """A change of one of several results alone."""
    return lambda results, *_: [x * FACTOR ** (k == which) for k, x in enumerate(results)]


FACTOR = 1 + SLIGHT_FAULT
ONE_BIT = put((7, 1), lambda x: np.nextafter(x, 1))
TILTED = put((0,), lambda x: x + SLIGHT_FAULT)  # gravity that is not along z
FOLDED = lambda H, q: H * (1 + SLIGHT_FAULT * (np.abs(q[..., 7:]).max() > 3))  # noqa: E731
SCALED = lambda H, q: H + 1e-14 * np.linalg.norm(q[..., 3:7])  # noqa: E731
STRETCHED = lambda x, _: x[..., :1, :] + (x - x[..., :1, :]) * FACTOR  # noqa: E731
UNLOADED = lambda v_dot, *given: v_dot - SLIGHT_FAULT * np.sum(np.abs(given[3]))  # noqa: E731
PULLING = lambda found, *_: (*found[:2], found[2] - [0, 0, 1e-3])  # noqa: E731
FAULTS = [
    ("mass_matrix", ONE_BIT, "mass matrix is symmetric"),
    ("mass_matrix", put((7, 7), np.negative), "mass matrix is positive definite"),
    (
        "bias_force",
        lambda force, q, _: force + 1e-12 * q[..., :1],
        "position and speed of the torso do not matter",
    ),
    ("bias_force", TILTED, "pose in the world turns all alike"),
    ("forward_dynamics", TILTED, "pose in the world turns all alike"),
    ("mass_matrix", FOLDED, "kinetic energy is half v H v"),
    ("mass_matrix", SCALED, "quaternion has no norm and no sign"),
    ("mass_matrix", batch_only, "batches are singles"),
    ("bias_force", Drifting(), "calls repeat"),
    ("momentum", refused, "momentum is mass times velocity"),
    ("center_of_mass", of_one(1), "velocity of the center of mass is J v"),
    ("center_of_mass", of_one(1), "momentum is mass times velocity of the center of mass"),
    ("tail_points", STRETCHED, "links have their length"),
    ("tail_points", STRETCHED, "jacobians are the derivatives of the points"),
    (
        "tail_point_jacobians",
        lambda J, _: J[..., [0, 1, 2, 3, 4, 5, 7, 6]],
        "jacobians are the derivatives of the points",
    ),
    ("forward_dynamics_external", UNLOADED, "loads accelerate by their generalised force"),
    ("leg_points", put((2, slice(None)), lambda x: x * FACTOR), "legs have their lengths"),
    ("air_force", times(-1), "air that rests takes energy"),
    ("forward_dynamics", times(FACTOR), "torques that make up for it rid a tail of it"),
    ("air_force", lambda force, *_: force + 1e-9, "air that moves along does nothing"),
    ("tendon_lengths", lambda found, *_: (found[0], -found[1]), "lengths change with the tail"),
    ("contact_points", of_one(1), "velocities are the rates of the points"),
    ("contact_dynamics", PULLING, "the ground never pulls nor holds by more than friction"),
]


def test_faults_break_the_law_that_is_there_for_them():
    for name, change, law in FAULTS:
        with row(law, name):
            assert notices(NAMED[law], name, change)


FLIGHT = "flights keep energy momentum and a parabola"
PASSIVE = "passive tails change energy by their damping alone"


def test_faults_of_flight_break_each_part_of_its_law(monkeypatch):
    entry, heavier, exact = NAMED[FLIGHT], 9.8 * (1 + 1e-8), {"rtol": 1e-13, "atol": 1e-15}
    model = sound(entry)
    for parts, gravity, settings in (
        ({"energy"}, 9.8, exact | {"controller": st.Damping(1e-9)}),
        ({"linear", "place"}, heavier, exact),
        ({"angular", "energy", "linear", "place"}, heavier, {"rtol": 1e-4}),
    ):

        def flight(model, s, gravity=gravity, settings=settings):
            flown, v = model.with_parameters(gravity=gravity), 10 / fastest(model, s.v) * s.v
            return st.simulate(flown, s.q, v, t_span=0.2, **settings)

        monkeypatch.setattr("serpentail.verification.value_laws.flight", flight)
        error = entry.error(model, next(states.states(model)))
        with row(parts):
            assert {part for part in error if error[part] > entry.limit(model)} == parts


def test_faults_of_a_tail_with_stops_break_its_law_of_flight(monkeypatch):
    """Energy of springs and stops that is off by 1e-4, momentum, and a slightly heavier fall."""

    def stored(result, *_):
        kinetic, potential = result
        return kinetic, potential * (1 + 1e-4)

    def flight(model, s, **settings):
        return value_laws.flight(model.with_parameters(gravity=9.8 * (1 + 1e-4)), s, **settings)

    for name, change in (("energy", stored), ("momentum", times(1 + 1e-4))):
        with row(name):
            assert notices(NAMED[PASSIVE], name, change)
    monkeypatch.setattr("serpentail.verification.acting_laws.flight", flight)
    assert notices(NAMED[PASSIVE], "energy", lambda result, *_: result)


def test_casadi_functions_that_are_slightly_wrong_fail():
    model = zoo.own("m1_n1")
    heavier = model.with_parameters(torso_mass=model.parameters["torso_mass"] * (1 + SLIGHT_FAULT))
    faulty = copy.copy(model)
    faulty.__dict__["casadi"] = heavier.casadi
    laws = {"casadi functions agree", "casadi externals are the compiled code"}
    assert failed(verify.laws(faulty)) == laws == {e.name for e in verify.LAWS if e.casadi}


def test_halves_of_segments_that_differ_from_wholes_fail(tmp_path):
    whole = zoo.model("m2_n2")
    other = whole.with_parameters(tail_mass=whole.parameters["tail_mass"] * (1 + SLIGHT_FAULT))
    cases = list(states.states(whole, 1))
    for model, status in ((other, "failed"), (whole, "passed")):
        assert verify_model.split_check(model, cases, tmp_path / status).status == status

"""Faults of one function: each breaks a law, and the one that is there for it."""

import copy

import numpy as np
import pytest

import serpentail as st
from serpentail.verification import report as verify
from serpentail.verification import states, value_laws
from serpentail.verification.law import fastest
from serpentail_codegen.functions.catalogue import CATALOGUE
from tests.support.elastic import FUNCTIONS, elastic_model
from tests.support.faults import (
    SLIGHT_FAULT,
    TAKING_MORE,
    broken,
    failed,
    laws_broken,
    not_a_number,
    times,
)
from tests.support.models import model_folder
from tests.verification import verify_model

# Faults of one function


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_function_that_is_slightly_wrong_breaks_a_law(having, name):
    assert laws_broken(broken(having(name), name, times(1 + SLIGHT_FAULT)))


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_function_that_loses_a_number_breaks_a_law(having, name):
    assert laws_broken(broken(having(name), name, not_a_number), 1)


@pytest.mark.parametrize("name", [name for name in CATALOGUE if name not in TAKING_MORE])
def test_every_function_that_is_slightly_wrong_is_not_what_its_program_means(model, name):
    faulty = broken(model, name, times(1 + SLIGHT_FAULT))
    cases = list(states.states(faulty, 1))
    assert failed(
        verify.check(e, faulty, cases) for e in verify_model.interpreter_laws(faulty)
    ) == {f"interpreter: {name}"}


@pytest.mark.parametrize(
    "reference", verify_model.REFERENCES[:3], ids=lambda reference: reference.title
)
def test_every_quantity_that_is_slightly_wrong_disagrees_with_references(model, reference):
    for name in reference.names:
        faulty = broken(model, name, times(1 + SLIGHT_FAULT))
        found = failed(
            verify_model.reference_checks(reference, faulty, list(states.states(faulty, 1)))
        )
        assert f"{reference.title}: {name}" in found


def asymmetric(H, _q):
    """One entry off by one bit."""
    H[..., 7, 1] = np.nextafter(H[..., 7, 1], 1)
    return H


def indefinite(H, _q):
    """A negative moment of inertia."""
    H[..., 7, 7] *= -1
    return H


def lighter(H, _q):
    """Another mass, only in the first block."""
    H[..., 0, 0] *= 1 + SLIGHT_FAULT
    return H


def placed(force, q, _v):
    """Depends on where B is."""
    return force + 1e-12 * q[..., :1]


def tilted(force, *_):
    """Gravity that is not along z."""
    force[..., 0] += SLIGHT_FAULT
    return force


def folded_only(H, q):
    """Wrong for folded tails alone."""
    return H * (1 + SLIGHT_FAULT * (np.abs(q[..., 7:]).max() > 3))


def scaled_attitude(H, q):
    """Depends on the quaternion's norm."""
    return H + 1e-14 * np.linalg.norm(q[..., 3:7])


def batch_only(H, q):
    """Wrong in the last state of a batch, by one bit."""
    if q.ndim == 2:
        H[-1, 0, 0] = np.nextafter(H[-1, 0, 0], 1)
    return H


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


def heavier_at_height(energy, *_):
    """Potential energy alone is wrong."""
    return energy[0], energy[1] * (1 + SLIGHT_FAULT)


def slower(center, *_):
    """The velocity of the centre of mass alone is wrong."""
    position, velocity, J = center
    return position, velocity * (1 + SLIGHT_FAULT), J


def stretched(points, q):
    """Links that are too long."""
    mount = points[..., :1, :]
    return mount + (points - mount) * (1 + SLIGHT_FAULT)


def swapped(J, _q):
    """Columns of alpha and beta in the wrong order."""
    J[..., [6, 7]] = J[..., [7, 6]]
    return J


def unloaded(v_dot, *arguments):
    """A load at the tip that does half of what it should."""
    return v_dot - SLIGHT_FAULT * np.sum(np.abs(arguments[3]))


def bent(joints, *_):
    """The knees alone are in the wrong place."""
    joints[..., 2, :] *= 1 + SLIGHT_FAULT
    return joints


FAULTS = {
    "asymmetric": ("mass_matrix", asymmetric, "mass matrix is symmetric"),
    "indefinite": ("mass_matrix", indefinite, "mass matrix is positive definite"),
    "lighter": ("mass_matrix", lighter, "translation carries the whole mass"),
    "placed": ("bias_force", placed, "position and speed of the torso do not matter"),
    "tilted": ("bias_force", tilted, "pose in the world turns all alike"),
    "tilted motion": ("forward_dynamics", tilted, "pose in the world turns all alike"),
    "folded only": ("mass_matrix", folded_only, "kinetic energy is half v H v"),
    "attitude": ("mass_matrix", scaled_attitude, "quaternion has no norm and no sign"),
    "batch only": ("mass_matrix", batch_only, "batches are singles"),
    "drifting": ("bias_force", Drifting(), "calls repeat"),
    "not a number": (
        "inverse_dynamics",
        not_a_number,
        "inverse dynamics is mass times acceleration plus bias",
    ),
    "refused": ("momentum", refused, "momentum is mass times velocity"),
    "heavy center": (
        "center_of_mass",
        times(1 + SLIGHT_FAULT),
        "center of mass is that of the mass matrix",
    ),
    "slow center": ("center_of_mass", slower, "velocity of the center of mass is J v"),
    "light center": (
        "center_of_mass",
        slower,
        "momentum is mass times velocity of the center of mass",
    ),
    "power": (
        "forward_dynamics",
        times(1 + SLIGHT_FAULT),
        "energy changes by the power of the torques",
    ),
    "torques": (
        "forward_dynamics",
        times(1 + SLIGHT_FAULT),
        "forward dynamics needs the torques it was given",
    ),
    "height": ("energy", heavier_at_height, "energy changes by the power of the torques"),
    "stretched": ("tail_points", stretched, "links have their length"),
    "stretched columns": ("tail_points", stretched, "jacobians are the derivatives of the points"),
    "swapped": ("tail_point_jacobians", swapped, "jacobians are the derivatives of the points"),
    "loads": ("forward_dynamics_external", unloaded, "loads accelerate by their generalised force"),
    "no load": ("forward_dynamics_external", times(1 + SLIGHT_FAULT), "no load is no change"),
    "inverse": (
        "forward_dynamics_external",
        times(1 + SLIGHT_FAULT),
        "forward dynamics inverts inverse dynamics",
    ),
    "world mass": ("mass_matrix_world", times(1 + SLIGHT_FAULT), "mass matrix in world axes"),
    "feet": ("leg_points", times(1 + SLIGHT_FAULT), "legs end in their feet"),
    "knees": ("leg_points", bent, "legs have their lengths"),
    "world bias": ("bias_force_world", times(1 + SLIGHT_FAULT), "bias force in world axes"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_break_the_law_that_is_there_for_them(having, fault):
    name, change, expected = FAULTS[fault]
    assert expected in laws_broken(broken(having(name), name, change))


@pytest.mark.parametrize(
    ("law", "changes"),
    [
        ("energy is constant in flight", {"controller": st.Damping(1e-9)}),
        ("momentum is constant in flight", {"gravity": 9.8 * (1 + 1e-8)}),
        ("center of mass flies a parabola", {"gravity": 9.8 * (1 + 1e-8)}),
    ],
    ids=["damped", "heavy momentum", "heavy fall"],
)
def test_faults_of_flight_break_the_laws_of_flight(model, monkeypatch, law, changes):
    def flight(model, s):
        flown = model.with_parameters(gravity=changes.get("gravity", 9.8))
        v, controller = 10 / fastest(model, s.v) * s.v, changes.get("controller")
        return st.simulate(flown, s.q, v, controller=controller, t_span=0.2)

    monkeypatch.setattr("serpentail.verification.value_laws.flight", flight)
    assert law in laws_broken(model)


def test_faults_of_a_tail_with_stops_break_its_law_of_flight(monkeypatch):
    """Energy of springs and stops that is off by 1e-4, momentum, and a slightly heavier fall."""
    sound = elastic_model(2, 3, functions=FUNCTIONS)
    name = "passive tails change energy by their damping alone"
    (law,) = (law for law in verify.LAWS if law.name == name)
    cases = list(states.states(sound))[::4]

    def stored(result, *_):
        kinetic, potential = result
        return kinetic, potential * (1 + 1e-4)

    for name, change in ((None, None), ("energy", stored), ("momentum", times(1 + 1e-4))):
        model = broken(sound, name, change) if name else sound
        assert verify.check(law, model, cases).passed == (name is None)

    def flight(model, s, **settings):
        return value_laws.flight(model.with_parameters(gravity=9.8 * (1 + 1e-4)), s, **settings)

    monkeypatch.setattr("serpentail.verification.passive_laws.flight", flight)
    assert not verify.check(law, sound, cases).passed


def test_casadi_functions_that_are_slightly_wrong_fail(model):
    heavier = model.with_parameters(torso_mass=model.parameters["torso_mass"] * (1 + SLIGHT_FAULT))
    faulty = copy.copy(model)
    faulty.__dict__["casadi"] = heavier.casadi
    assert failed(verify.laws(faulty)) == {
        "casadi functions agree",
        "casadi externals are the compiled code",
    }


# Faults that all functions share


def test_another_animal_obeys_the_laws_and_only_references_notice(model):
    other = model.with_parameters(
        torso_inertia=[x * (1 + SLIGHT_FAULT) for x in model.parameters["torso_inertia"]]
    )
    other.parameters = model.parameters
    assert laws_broken(other) == set()
    for reference in verify_model.REFERENCES[:3]:
        found = failed(
            verify_model.reference_checks(reference, other, list(states.states(other, 1)))
        )
        assert f"{reference.title}: mass_matrix" in found
        assert f"{reference.title}: forward_dynamics" in found


def test_halves_of_segments_that_differ_from_wholes_fail(tmp_path):
    whole = st.load(model_folder(1, 2))
    other = whole.with_parameters(tail_mass=whole.parameters["tail_mass"] * (1 + SLIGHT_FAULT))
    check = verify_model.split_check(other, list(states.states(other, 1)), tmp_path)
    assert check.status == "failed"
    assert (
        verify_model.split_check(whole, list(states.states(whole, 1)), tmp_path).status == "passed"
    )

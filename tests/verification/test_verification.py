"""Verification: sound models pass every check, and every kind of fault fails the check that is
there for it.
"""

import copy
import json
import re

import numpy as np
import pytest
from sympy import Matrix

import serpentail as st
from serpentail.verification import errors, law, states
from serpentail.verification import report as verify
from serpentail.verification.law import fastest
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.contact import CONTACT
from serpentail_codegen.functions.implicit.functions import IMPLICIT
from serpentail_codegen.functions.pfl import FEEDBACK
from serpentail_codegen.mechanics import link, loads, torso
from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.scene.scene import ON_DEMAND
from tests.references import metrics
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.support.models import model_folder
from tests.verification import verify_model

SOUND = {
    "m1_n1": (1, 1, {}),
    "loops": (2, 1, {"emission": "loops", "functions": "all"}),
    "float": (1, 2, {"real": "float"}),
    "baked": (1, 2, {"baked": True}),
}
SOUND_SLOW = {
    "m1_n3": (1, 3, {"functions": "all"}),
    "m2_n2": (2, 2, {}),
    "m3_n4": (3, 4, {}),
    "m6_n8": (6, 8, {"functions": "all"}),
    "m1_n20": (1, 20, {}),
    "float loops": (3, 4, {"real": "float", "emission": "loops", "functions": "all"}),
    "other parameters": (
        3,
        2,
        {"parameters": {"torso_mass": 60.0, "torso_inertia": [2.0, 1.5, 3.0], "tail_mass": 5.0}},
    ),
    "no gravity": (2, 3, {"parameters": {"gravity": 0.0, "tail_mass": 0.05}}),
    "continuum": (2, None, {"functions": "all"}),
    "continuum float": (1, None, {"real": "float"}),
}
SLIGHT = 1e-9
TAKING_MORE = (*CONTACT, *IMPLICIT)  # functions of more than a state


@pytest.fixture(scope="module")
def model():
    """A sound model with all functions."""
    return st.load(model_folder(1, 3, functions="all"))


@pytest.fixture(scope="module")
def having(model):
    """Return a function from a function's name to a sound model that has it."""
    names = ["mass_matrix", "bias_force", *CONTACT]
    touching = st.load(model_folder(1, 3, functions=names, contacts=["feet", "tail", "torso"]))
    return lambda name: touching if name in CONTACT else model


def failed(checks):
    """Names of the checks that failed."""
    return {c.name for c in checks if not c.passed}


def laws_broken(model, count=2):
    """Names of the laws that a model breaks, CasADi's left out: they compare with the C, which is
    at fault here.
    """
    cases = list(states.states(model, count))
    entries = [entry for entry in verify.LAWS if "casadi" not in entry.name]
    return failed(verify.check(entry, model, cases) for entry in entries)


def broken(model, name, change):
    """The model with one function whose result, and arguments, go through a change."""
    faulty, kernel = copy.copy(model), model.kernel(name)

    def call(*arrays):
        return change(kernel(*arrays), *arrays)

    faulty.kernels = model.kernels | {name: call}
    return faulty


def times(factor):
    """A change that multiplies every output."""
    return lambda result, *_: (
        tuple(factor * x for x in result) if isinstance(result, tuple) else factor * result
    )


# Sound models


@pytest.mark.parametrize("name", SOUND)
def test_sound_models_pass(name):
    segments, links, options = SOUND[name]
    assert_sound(
        verify_model.verify(model_folder(segments, links, **options)), options.get("functions")
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", SOUND_SLOW)
def test_other_sound_models_pass(name):
    segments, links, options = SOUND_SLOW[name]
    assert_sound(
        verify_model.verify(model_folder(segments, links, **options)), options.get("functions")
    )


def assert_sound(checks, functions=None):
    """Everything was checked but what cannot be, and nothing failed."""
    assert [c for c in checks if not c.passed] == []
    reasons = {c.omitted for c in checks if c.omitted}
    if functions != "all":
        reasons = {r for r in reasons if not r.startswith("not generated: ") or not on_demand(r)}
    others = {"only for double models", "only for articulated models", "only for contact models"}
    assert reasons <= others | {"no even m or n of links"}


def on_demand(reason):
    """Whether all functions that a reason says are missing are emitted only where a scene names
    them.
    """
    absent = set(reason.removeprefix("not generated: ").split(", "))
    return absent <= {*ON_DEMAND, *FEEDBACK, *IMPLICIT}


def test_all_laws_hold_without_peers(model):
    checks = verify.laws(model)
    assert failed(checks) == set()
    assert len({c.name for c in checks}) == len(checks) == len(verify.LAWS)
    assert all(re.fullmatch(r".+\.", c.law) and "\n" not in c.law for c in checks)


# Faults of one function


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_function_that_is_slightly_wrong_breaks_a_law(having, name):
    assert laws_broken(broken(having(name), name, times(1 + SLIGHT)))


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_function_that_loses_a_number_breaks_a_law(having, name):
    assert laws_broken(broken(having(name), name, not_a_number), 1)


@pytest.mark.parametrize("name", [name for name in CATALOGUE if name not in TAKING_MORE])
def test_every_function_that_is_slightly_wrong_is_not_what_its_program_means(model, name):
    faulty = broken(model, name, times(1 + SLIGHT))
    cases = list(states.states(faulty, 1))
    assert failed(
        verify.check(e, faulty, cases) for e in verify_model.interpreter_laws(faulty)
    ) == {f"interpreter: {name}"}


@pytest.mark.parametrize(
    "reference", verify_model.REFERENCES[:3], ids=lambda reference: reference.title
)
def test_every_quantity_that_is_slightly_wrong_disagrees_with_references(model, reference):
    for name in reference.names:
        faulty = broken(model, name, times(1 + SLIGHT))
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
    H[..., 0, 0] *= 1 + SLIGHT
    return H


def placed(force, q, _v):
    """Depends on where B is."""
    return force + 1e-12 * q[..., :1]


def tilted(force, *_):
    """Gravity that is not along z."""
    force[..., 0] += SLIGHT
    return force


def folded_only(H, q):
    """Wrong for folded tails alone."""
    return H * (1 + SLIGHT * (np.abs(q[..., 7:]).max() > 3))


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


def not_a_number(result, *_):
    """The last entry of the last output is lost."""
    outputs = [np.array(x) for x in (result if isinstance(result, tuple) else (result,))]
    outputs[-1][(..., *(-1,) * min(1, outputs[-1].ndim))] = np.nan
    return tuple(outputs) if isinstance(result, tuple) else outputs[0]


def refused(_result, *_):
    """A model that refuses sound states."""
    raise st.StateError("refused")


def heavier_at_height(energy, *_):
    """Potential energy alone is wrong."""
    return energy[0], energy[1] * (1 + SLIGHT)


def stretched(points, q):
    """Links that are too long."""
    mount = points[..., :1, :]
    return mount + (points - mount) * (1 + SLIGHT)


def swapped(J, _q):
    """Columns of alpha and beta in the wrong order."""
    J[..., [6, 7]] = J[..., [7, 6]]
    return J


def unloaded(v_dot, *arguments):
    """A load at the tip that does half of what it should."""
    return v_dot - SLIGHT * np.sum(np.abs(arguments[3]))


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
    "power": ("forward_dynamics", times(1 + SLIGHT), "energy changes by the power of the torques"),
    "torques": (
        "forward_dynamics",
        times(1 + SLIGHT),
        "forward dynamics needs the torques it was given",
    ),
    "height": ("energy", heavier_at_height, "energy changes by the power of the torques"),
    "stretched": ("tail_points", stretched, "links have equal length"),
    "stretched columns": ("tail_points", stretched, "jacobians are the derivatives of the points"),
    "swapped": ("tail_point_jacobians", swapped, "jacobians are the derivatives of the points"),
    "loads": ("forward_dynamics_external", unloaded, "loads accelerate by their generalised force"),
    "no load": ("forward_dynamics_external", times(1 + SLIGHT), "no load is no change"),
    "inverse": (
        "forward_dynamics_external",
        times(1 + SLIGHT),
        "forward dynamics inverts inverse dynamics",
    ),
    "world mass": ("mass_matrix_world", times(1 + SLIGHT), "mass matrix in world axes"),
    "world bias": ("bias_force_world", times(1 + SLIGHT), "bias force in world axes"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_break_the_law_that_is_there_for_them(model, fault):
    name, change, expected = FAULTS[fault]
    assert expected in laws_broken(broken(model, name, change))


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


def test_casadi_functions_that_are_slightly_wrong_fail(model):
    heavier = model.with_parameters(torso_mass=model.parameters["torso_mass"] * (1 + SLIGHT))
    faulty = copy.copy(model)
    faulty.__dict__["casadi"] = heavier.casadi
    assert failed(verify.laws(faulty)) == {
        "casadi functions agree",
        "casadi externals are the compiled code",
    }


# Faults that all functions share


def test_another_animal_obeys_the_laws_and_only_references_notice(model):
    other = model.with_parameters(
        torso_inertia=[x * (1 + SLIGHT) for x in model.parameters["torso_inertia"]]
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
    other = whole.with_parameters(tail_mass=whole.parameters["tail_mass"] * (1 + SLIGHT))
    check = verify_model.split_check(other, list(states.states(other, 1)), tmp_path)
    assert check.status == "failed"
    assert (
        verify_model.split_check(whole, list(states.states(whole, 1)), tmp_path).status == "passed"
    )


def without_gyroscopic_torque(let, link, w, w_dot, a_joint, swing):
    """A link's wrench without omega x I omega, which does no work."""
    wrench = LINK_WRENCH(let, link, w, w_dot, a_joint, swing)["F"]
    return {"F": wrench - LINK_WRENCH(let, link, w, 0 * w_dot, 0 * a_joint, 0 * swing)["F"]}


def without_joint_acceleration(let, link, w, w_dot, a_joint, swing):
    """A link's wrench whose moment leaves out how its joint accelerates."""
    F = LINK_WRENCH(let, link, w, w_dot, a_joint, swing)["F"]
    still = LINK_WRENCH(let, link, w, w_dot, 0 * a_joint, swing)["F"]
    return {"F": F[0:3, :].col_join(still[3:6, :])}


def with_flat_load(let, R, f_torso, F_beyond):
    """Loads at B taken as if B were upright."""
    return LOAD_AT_TORSO(let, 0 * R + Matrix([1, 0, 0, 0, 1, 0, 0, 0, 1]), f_torso, F_beyond)


def with_weak_gravity(let, R, p_ddot, gravity):
    """Gravity in C and forward dynamics that differs from the potential's."""
    return TORSO_ACCELERATION(let, R, p_ddot, gravity * 2)


def with_load_at_the_wrong_place(let, R, P, f_point, F_beyond):
    """Tail loads that act 1 % too far from B."""
    return LOAD_AT_POINT(let, R, P * 101 / 100, f_point, F_beyond)


LINK_WRENCH, LOAD_AT_TORSO, LOAD_AT_POINT = (
    link.link_wrench,
    loads.load_at_torso,
    loads.load_at_point,
)
TORSO_ACCELERATION = torso.torso_acceleration
DERIVATION_FAULTS = {
    "gyroscopic": (
        link,
        "link_wrench",
        without_gyroscopic_torque,
        "momentum is constant in flight",
    ),
    "acceleration": (
        link,
        "link_wrench",
        without_joint_acceleration,
        "energy changes by the power of the torques",
    ),
    "flat load": (loads, "load_at_torso", with_flat_load, "pose in the world turns all alike"),
    "gravity": (
        torso,
        "torso_acceleration",
        with_weak_gravity,
        "forward dynamics needs the torques it was given",
    ),
    "load": (
        loads,
        "load_at_point",
        with_load_at_the_wrong_place,
        "loads accelerate by their generalised force",
    ),
}


@pytest.mark.parametrize("fault", DERIVATION_FAULTS)
def test_faults_of_the_derivation_break_a_law(fault, monkeypatch, tmp_path):
    module, name, wrong, expected = DERIVATION_FAULTS[fault]
    monkeypatch.setattr(module, name, wrong)
    scene = scene_for("articulated", 1, 1, name="faulty")
    generate(scene, tmp_path)
    assert expected in laws_broken(st.load(tmp_path / "faulty"))


# Reports


def test_what_was_left_out_is_said(tmp_path):
    model = st.load(model_folder(1, 2, functions=["mass_matrix", "tail_points"]))
    checks = verify_model.judge(model)
    omitted = {c.name: c.omitted for c in checks if c.omitted}
    assert omitted["kinetic energy is half v H v"] == "not generated: energy"
    assert omitted["energy is constant in flight"] == "not generated: rollout, energy, momentum"
    assert omitted["interpreter: bias_force"] == "not generated: bias_force"
    assert omitted["Pinocchio: momentum"] == "not generated: momentum"
    assert omitted["halves of segments"] == "not generated: mass_matrix or bias_force"
    assert failed(checks) == set()
    assert {c.name for c in checks if c.status == "passed"} >= {
        "mass matrix is symmetric",
        "calls repeat",
    }
    report = verify.summary(model, checks)
    assert report["counts"]["not checked"] == len(omitted)
    assert "not generated: energy" in verify.as_text(model, checks)
    assert "not generated: energy" in verify_model.markdown(model, checks)


@pytest.mark.parametrize("name", list(CATALOGUE))
def test_a_model_of_one_function_is_checked(name):
    asked = {"tracked_dynamics": ["pfl", "rollout"]}.get(
        name, [name.removesuffix("_factor").removesuffix("_solve")]
    )
    model = st.load(
        model_folder(1, 1, functions=asked, **({"contacts": ["tail"]} if name in CONTACT else {}))
    )
    checks = verify.laws(model)
    assert failed(checks) == set()
    if name in TAKING_MORE:
        return
    expected = {"calls repeat", "batches are singles", "casadi externals are the compiled code"}
    expected |= {"casadi functions agree"} if name not in errors.DERIVATIVES else set()
    assert expected <= {c.name for c in checks if c.status == "passed"}


def test_summary_is_strict_json(model):
    faulty = broken(model, "bias_force", not_a_number)
    checks = verify.laws(faulty)
    report = json.loads(json.dumps(verify.summary(faulty, checks), allow_nan=False))
    assert report["passed"] is False and report["name"] == model.name
    row = next(row for row in report["checks"] if row["name"].startswith("inverse dynamics"))
    assert row["error"] is None and row["status"] == "failed"
    sound = verify.summary(model, verify.laws(model))
    assert sound["passed"] is True and sound["counts"]["failed"] == 0


@pytest.mark.parametrize(
    ("error", "passed"), [(0.0, True), (1.0, True), (1.0 + 1e-15, False), (np.nan, False)]
)
def test_a_check_passes_up_to_its_limit(error, passed):
    assert verify.Check("name", "Law.", error, 1.0).passed is passed


def test_a_failed_check_states_its_law(model):
    text = verify.as_text(model, [verify.Check("name", "A law.", 2.0, 1.0, "random")])
    assert "FAILED random" in text and "A law." in text


def test_command_writes_reports_and_returns_one_where_a_check_failed(tmp_path, capsys, monkeypatch):
    folder, output = model_folder(1, 2), tmp_path / "reports"
    assert verify_model.main([str(folder), "--output", str(output)]) == 0
    report = json.loads((output / "articulated_m1_n2.json").read_text())
    assert report["passed"] and report["counts"]["failed"] == 0
    assert (
        "| mass matrix is symmetric | 0 | 0 | passed |"
        in (output / "articulated_m1_n2.md").read_text()
    )
    assert len(capsys.readouterr().out.splitlines()) < 12
    monkeypatch.setattr(
        verify_model, "verify", lambda folder: [verify.Check("name", "Law.", 2.0, 1.0)]
    )
    assert verify_model.main([str(folder), "--output", str(output)]) == 1
    assert "FAILED" in capsys.readouterr().out


def test_command_refuses_what_is_no_model(tmp_path, capsys):
    assert verify_model.main([str(tmp_path)]) == 2
    assert "manifest.json" in capsys.readouterr().err


# Measures and states


def test_errors_are_measured_as_the_references_measure():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(8, 8))
    H = root @ root.T
    other = H + 1e-9 * rng.normal(size=(8, 8))
    assert errors.matrix_error(other, H) == pytest.approx(
        metrics.mass_matrix_error(other, H), rel=1e-12
    )
    assert errors.block_error(other[0], H[0]) == pytest.approx(
        metrics.block_error(other[0], H[0]), rel=1e-12
    )
    assert errors.condition(H) == pytest.approx(metrics.equilibrated_condition(H), rel=1e-12)


def test_condition_without_a_mass_matrix_is_of_the_same_size(model):
    partial = copy.copy(model)
    partial.kernels = {"forward_dynamics": model.kernel("forward_dynamics")}
    for s in states.states(model):
        ratio = errors.sensitivity(partial, s.q) / errors.sensitivity(model, s.q)
        assert 0.01 < ratio < 1.001


def test_slope_is_the_derivative():
    slope, largest = law.slope(lambda t: np.array([np.sin(3 * t + 1), np.cos(3 * t)]), 3.0)
    np.testing.assert_allclose(slope, [3 * np.cos(1), 0], rtol=0, atol=3e-14)
    assert (largest <= 1).all() and largest[1] > 0.99


def test_moved_follows_the_velocity(model):
    s = next(states.states(model))
    there = law.moved(s.q, s.v, 1e-6)
    rate = (there - law.moved(s.q, s.v, -1e-6)) / 2e-6
    w, x, y, z = s.q[3:7]
    Q = np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
    np.testing.assert_allclose(
        rate, np.concatenate([s.v[:3], Q @ s.v[3:6] / 2, s.v[6:]]), rtol=1e-8, atol=1e-8
    )
    assert np.linalg.norm(there[3:7]) == pytest.approx(1, abs=1e-14)


def test_states_are_of_all_kinds_seeded_and_exact_in_the_real_type():
    for options in ({}, {"real": "float"}):
        model = st.load(model_folder(1, 2, **options))
        first, again = list(states.states(model)), list(states.states(model))
        assert [s.kind for s in first] == [kind for kind in states.KINDS for _ in range(4)]
        for one, other in zip(first, again, strict=True):
            for name in ("q", "v", "v_dot", "tau", "f_ext"):
                x = getattr(one, name)
                np.testing.assert_array_equal(x, getattr(other, name))
                np.testing.assert_array_equal(x, x.astype(model.parameter_vector.dtype))
        assert not any(s.q[7:].any() for s in first if s.kind == "straight")
        assert all(abs(abs(s.q[7:]) - np.pi).max() < 0.011 for s in first[8::2])


# Accuracy: H and C to 1e-13, v_dot to 5e-15 times the condition of H, at 40 digits


def exact_errors(model, chain, s):
    """Errors of H, C and v_dot, the last relative to the condition number, by the references'
    measures.
    """
    H = chain.mass_matrix(s.q)
    v_dot = metrics.block_error(
        model.forward_dynamics(s.q, s.v, s.tau), chain.forward_dynamics(s.q, s.v, s.tau)
    )
    return {
        "H": metrics.mass_matrix_error(model.mass_matrix(s.q), H),
        "C": metrics.block_error(model.bias_force(s.q, s.v), chain.bias_force(s.q, s.v)),
        "v_dot": v_dot / metrics.equilibrated_condition(H),
    }


def limits(model, kind):
    """Where every joint is folded, what H sums cancels: libraries' v_dot is off by 1e-14 to 2e-14,
    H by 3e-13.
    """
    crowd = 5 if kind == "folded" and (model.links or 0) > 8 else 1
    return {
        "H": 1e-13 * crowd,
        "C": 1e-13 * crowd,
        "v_dot": 2e-14 * crowd if kind == "folded" else 5e-15,
    }


def assert_accurate(model, chain, states):
    """Every error is within its limit at every state."""
    for s in states:
        limit = limits(model, s.kind)
        errors = exact_errors(model, chain, s)
        assert {key: error for key, error in errors.items() if not error <= limit[key]} == {}, (
            s.kind
        )


def lean(segments, links):
    """A model with what accuracy is measured of."""
    return st.load(
        model_folder(segments, links, functions=["mass_matrix", "bias_force", "forward_dynamics"])
    )


@pytest.mark.slow
@pytest.mark.parametrize("links", range(1, 9))
@pytest.mark.parametrize("segments", range(1, 7))
def test_accuracy(segments, links):
    model = lean(segments, links)
    assert_accurate(model, ExactChain(model.parameters, segments, links), states.states(model, 2))


@pytest.mark.slow
def test_accuracy_of_128_links():
    model = lean(8, 16)
    assert_accurate(model, ExactChain(model.parameters, 8, 16), states.states(model, 2))


@pytest.mark.slow
@pytest.mark.parametrize("segments", [1, 2, 3, 6])
def test_accuracy_of_the_continuum(segments):
    model = lean(segments, None)
    assert_accurate(model, ExactContinuum(model.parameters, segments), states.states(model, 1))


@pytest.mark.slow
@pytest.mark.parametrize("segments", [1, 3])
def test_accuracy_where_the_last_link_lies_along_its_own_pitch_axis(segments):
    model = lean(segments, 1)
    chain = ExactChain(model.parameters, segments, 1)
    for s in states.states(model, 1):
        for short_of in (0.0, 1e-3, 1e-2, 0.1):
            s.q[-1] = np.pi / 2 - short_of
            assert_accurate(model, chain, [s])

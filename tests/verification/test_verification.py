"""Sound models pass every check, and reports say what was checked and what was not."""

import copy
import json
import re
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

import serpentail as st
from serpentail.verification import errors, law, states
from serpentail.verification import report as verify
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_scene.signatures import gradients
from serpentail_scene.signatures.table import AIRBORNE, DERIVATIVES, NEEDS
from tests.references import metrics
from tests.support import models, zoo
from tests.support.faults import TAKING_MORE, broken, failed, not_a_number
from tests.support.rows import row
from tests.verification import verify_model

SOUND = ("m1_n1", "arcs1", "elastic", "single_ground")
OTHERS = [  # polar ones have no states
    pytest.param(n, marks=pytest.mark.slow) for n in zoo.ZOO if n not in (*SOUND, "polar")
]
KINDS = ("double", "articulated", "contact", "passive", "air", "tendons")
REASONS = {f"only for {kind} models" for kind in KINDS}
REASONS |= {"no even m or n of links", "only for a torso that moves", verify_model.PLAIN}
REASONS |= {"it says nothing about this model"}
REASONS |= {"the passive tail cannot be left out: parameters are baked"}
REASONS |= {"No module named 'pinocchio'"} if find_spec("pinocchio") is None else set()
OTHER_NUMBERS = {  # of a large animal, and of one without weight
    "m2_n2": {"torso_mass": 60.0, "torso_inertia": [2.0, 1.5, 3.0], "tail_mass": 5.0},
    "m1_n3": {"gravity": 0.0, "tail_mass": 0.05},
}


@pytest.mark.parametrize("name", [*SOUND, *OTHERS])
def test_sound_models_pass(name):
    """Everything was checked but what cannot be, and nothing failed."""
    checks = verify_model.verify(zoo.folder(name))
    assert [c for c in checks if not c.passed] == []
    reasons = {c.omitted for c in checks if c.omitted} - REASONS
    assert all(missing_in(zoo.model(name), reason) for reason in reasons)


def missing_in(model, reason):
    """Tell if a model lacks all functions that a reason says are not generated."""
    assert reason.startswith("not generated: "), reason
    absent = re.split(r", | or ", reason.removeprefix("not generated: "))
    return absent[0].startswith("the functions") or not {*absent} & {*model.generated}


def test_laws_hold_for_other_animals():
    for name, numbers in OTHER_NUMBERS.items():
        with row(name):
            checks = verify.laws(zoo.own(name).with_parameters(**numbers))
            assert failed(checks) == set()
            assert len({c.name for c in checks}) == len(checks) == len(verify.LAWS)


@pytest.mark.slow
@pytest.mark.parametrize(("segments", "links"), [(6, 8), (1, 20)])
def test_long_tails_and_long_segments_pass(segments, links):
    """Their size is the point: limits grow with the links of a segment."""
    checks = verify_model.verify(models.model_folder(segments, links))
    assert [c for c in checks if not c.passed] == []


def test_batches_in_lanes_are_singles_but_for_rounding(monkeypatch):
    """Compiled as a user's are, where other operations are fused; else one bit is a fault."""
    monkeypatch.setenv("CC", "cc")
    for profile, lanes, fault in (
        ("fast", False, 3e-16),
        ("fast", True, 1e-9),
        ("reproducible", True, 3e-16),
    ):

        def last_only(x, q, *_, fault=fault):
            return x * (1 + fault * (np.arange(len(x)) == 8)[:, None]) if q.ndim == 2 else x

        model = st.load(zoo.folder("bare"), profile=profile)
        assert not lanes or model.batch_library.entry("forward_dynamics", 1000)
        with row(profile, lanes):
            assert failed(verify.laws(model)) == set()
            faulty = broken(model, "forward_dynamics", last_only)
            assert "batches are singles" in failed(verify.laws(faulty))


# Reports


def test_what_was_left_out_is_said():
    pytest.importorskip("pinocchio")
    model = zoo.own("bare")
    checks = verify_model.judge(model)
    omitted = {c.name: c.omitted for c in checks if c.omitted}
    assert omitted["kinetic energy is half v H v"] == "not generated: mass_matrix, energy"
    assert omitted["interpreter: bias_force"] == "not generated: bias_force"
    assert omitted["Pinocchio: momentum"] == "not generated: momentum"
    assert omitted["halves of segments"] == "no even m or n of links"
    assert failed(checks) == set()
    passed = {"calls repeat", "batches are singles", "Pinocchio: forward_dynamics"}
    assert passed <= {c.name for c in checks if c.status == "passed"}
    assert verify.summary(model, checks)["counts"]["not checked"] == len(omitted)
    *_, left_out, verdict = verify.as_text(model, checks).split("\n")
    generated = sum(reason.startswith("not generated") for reason in omitted.values())
    assert f"{generated} not generated" in left_out
    assert verdict.endswith(f"all {len(checks) - len(omitted)} laws that were checked hold")
    wrong = replace(checks[0], error=np.inf, omitted="")
    assert checks[0].name in verify.verdict(model, [wrong, *checks[1:]])
    assert "energy" not in verify.as_short_text(model, checks)


@pytest.mark.slow
def test_a_model_of_one_function_is_checked():
    """Each of these models has one function, which is the point."""
    for name in {*CATALOGUE} - {each.name for each in gradients.SIGNATURES} - {"push_rates"}:
        with row(name):
            asked = {"tracked_dynamics": ["pfl", "rollout"], "contact_rates": ["rollout"]}
            asked = asked.get(name, [name.removesuffix("_factor").removesuffix("_solve")])
            touching = {"contacts": ["tail"], "feet": ["feet"]}.get(NEEDS.get(name), [])
            air = {"air_density": 1.2} if NEEDS.get(name) == "air" else {}
            pulled = {"tendon": zoo.RING} if NEEDS.get(name) == "tendons" else {}
            given = {**pulled, "functions": asked, "contacts": touching, "parameters": air}
            folder = models.model_folder(1, 1, **given)
            checks = verify.laws(st.load(folder))
            assert failed(checks) == set()
            expected = {"calls repeat", "batches are singles"}
            expected |= {"casadi externals are the compiled code"}
            if name not in (*DERIVATIVES, *AIRBORNE):
                expected |= {"casadi functions agree"}
            passed = {c.name for c in checks if c.status == "passed"}
            assert name in TAKING_MORE or expected <= passed


def test_summary_is_strict_json():
    model = zoo.own("m1_n1")
    for faulty in (True, False):
        judged = broken(model, "bias_force", not_a_number) if faulty else model
        told = verify.summary(judged, verify.laws(judged))
        report = json.loads(json.dumps(told, allow_nan=False))
        assert report["passed"] is not faulty and report["name"] == model.name
        assert bool(report["counts"]["failed"]) == faulty
        rows = {entry["name"]: entry for entry in report["checks"]}
        inverse = rows["inverse dynamics is mass times acceleration plus bias"]
        assert inverse["status"] == ("failed" if faulty else "passed")
        assert (inverse["error"] is None) == faulty


def test_a_check_passes_up_to_its_limit_and_states_its_law_where_it_failed():
    rows = [(0.0, True), (1.0, True), (1.0 + 1e-15, False), (np.nan, False)]
    for error, passed in rows:
        with row(error):
            assert verify.Check("name", "Law.", error, 1.0).passed is passed
    check = verify.Check("name", "A law.", 2.0, 1.0, "random")
    assert re.search(r"FAILED random\n +A law\.", verify.as_text(zoo.model("bare"), [check]))


# Measures and states


def test_errors_are_measured_as_the_references_measure():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(8, 8))
    H = root @ root.T
    other = H + 1e-9 * rng.normal(size=(8, 8))
    pairs = [
        (errors.matrix_error(other, H), metrics.mass_matrix_error(other, H)),
        (errors.block_error(other[0], H[0]), metrics.block_error(other[0], H[0])),
        (errors.condition(H), metrics.equilibrated_condition(H)),
    ]
    np.testing.assert_allclose(*zip(*pairs, strict=True), rtol=1e-12)


def test_condition_without_a_mass_matrix_is_of_the_same_size():
    model = zoo.model("m1_n3")
    partial = copy.copy(model)
    partial.kernels = {"forward_dynamics": model.kernel("forward_dynamics")}
    for s in states.states(model):
        ratio = errors.sensitivity(partial, s.q) / errors.sensitivity(model, s.q)
        assert 0.01 < ratio < 1.001
    partial.kernels = {}
    assert errors.sensitivity(partial, s.q) == 1.0


def test_slope_is_the_derivative():
    slope, largest = law.slope(lambda t: np.array([np.sin(3 * t + 1), np.cos(3 * t)]), 3.0)
    np.testing.assert_allclose(slope, [3 * np.cos(1), 0], rtol=0, atol=3e-14)
    assert (largest <= 1).all() and largest[1] > 0.99


def test_states_are_of_all_kinds_seeded_and_exact_in_the_real_type():
    for name in ("m1_n3", "single"):
        with row(name):
            model = zoo.model(name)
            first, again = list(states.states(model)), list(states.states(model))
            assert [s.kind for s in first] == [kind for kind in states.KINDS for _ in range(4)]
            for one, other in zip(first, again, strict=True):
                for key in ("q", "v", "v_dot", "tau", "f_ext"):
                    x = getattr(one, key)
                    np.testing.assert_array_equal(x, getattr(other, key))
                    np.testing.assert_array_equal(x, x.astype(model.parameter_vector.dtype))
            assert not any(s.q[7:].any() for s in first if s.kind == "straight")
            assert all(abs(abs(s.q[7:]) - np.pi).max() < 0.011 for s in first[8::2])
    model = zoo.model("mixed")
    folded = next(s.q[7:] for s in states.states(model) if s.kind == "folded")
    links = np.repeat(model.kinds, model.layout.widths) != "continuum"
    assert abs(abs(folded[links]) - np.pi).max() < 0.011 and len({*folded}) == len(folded)

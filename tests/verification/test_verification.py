"""Sound models pass every check, and reports say what was checked and what was not."""

import json
import re

import numpy as np
import pytest

import serpentail as st
from serpentail.verification import report as verify
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.scene.signatures.table import (
    AIRBORNE,
    DEFAULT,
    DERIVATIVES,
    NEEDS,
    SIGNATURES,
)
from tests.support.elastic import ALL
from tests.support.faults import TAKING_MORE, broken, failed, not_a_number
from tests.support.models import model_folder
from tests.verification import verify_model

SOUND = {
    "m1_n1": (1, 1, {}),
    "loops": (2, 1, {"emission": "loops", "functions": "all"}),
    "float": (1, 2, {"real": "float"}),
    "baked": (1, 2, {"baked": True}),
    "feet": (1, 1, {"contacts": ["feet", "tail", "torso"]}),
    "feet, float": (1, 1, {"contacts": ["feet"], "real": "float"}),
    "passive": (2, 1, {"functions": "all", "parameters": ALL}),
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
    kinds = ("double", "articulated", "contact", "passive")
    assert reasons <= {f"only for {kind} models" for kind in kinds} | {"no even m or n of links"}


def on_demand(reason):
    """Whether all functions that a reason says are missing are emitted only where a scene names
    them.
    """
    absent = set(reason.removeprefix("not generated: ").split(", "))
    return absent <= set(SIGNATURES) - {*DEFAULT, *NEEDS}


def test_all_laws_hold_without_peers(model):
    checks = verify.laws(model)
    assert failed(checks) == set()
    assert len({c.name for c in checks}) == len(checks) == len(verify.LAWS)
    assert all(re.fullmatch(r".+\.", c.law) and "\n" not in c.law for c in checks)


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
    assert "energy" not in verify.as_short_text(model, checks)


@pytest.mark.parametrize("name", list(CATALOGUE))
def test_a_model_of_one_function_is_checked(name):
    asked = {"tracked_dynamics": ["pfl", "rollout"], "contact_rates": ["rollout"]}.get(
        name, [name.removesuffix("_factor").removesuffix("_solve")]
    )
    touching = {"contacts": ["tail"], "feet": ["feet"]}
    model = st.load(
        model_folder(
            1, 1, functions=asked, **({"contacts": touching[NEEDS[name]]} if name in NEEDS else {})
        )
    )
    checks = verify.laws(model)
    assert failed(checks) == set()
    if name in TAKING_MORE:
        return
    expected = {"calls repeat", "batches are singles", "casadi externals are the compiled code"}
    expected |= {"casadi functions agree"} if name not in (*DERIVATIVES, *AIRBORNE) else set()
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
    assert verify_model.report(folder, output) == 0
    report = json.loads((output / "articulated_m1_n2.json").read_text())
    assert report["passed"] and report["counts"]["failed"] == 0
    text, printed = (output / "articulated_m1_n2.txt").read_text(), capsys.readouterr().out
    assert re.search(r"^  mass matrix is symmetric +0 +0$", text, re.MULTILINE)
    assert re.search(r"^  Pinocchio +9 +0 +0   ", printed, re.MULTILINE)
    assert len(printed.splitlines()) < 12 and text.startswith(printed.partition("  report")[0])
    monkeypatch.setattr(
        verify_model, "verify", lambda folder: [verify.Check("name", "Law.", 2.0, 1.0)]
    )
    assert verify_model.report(folder, output) == 1
    assert "FAILED" in capsys.readouterr().out


def test_command_refuses_what_is_no_model(tmp_path, capsys):
    assert verify_model.report(tmp_path, tmp_path) == 2
    assert "manifest.json" in capsys.readouterr().err

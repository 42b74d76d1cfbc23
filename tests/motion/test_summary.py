"""Numbers of runs of every kind: as JSON, as aligned text, as tables; none where there is none."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.motion import numbers
from serpentail.motion.summary import summary
from serpentail.motion.table import as_text, as_word
from tests.support import zoo

from .conftest import at_height, down, made, scene_of

ROOT = Path(__file__).parents[2]
OF_EVENTS = {
    *("take_off_s", "recontact_s", "landing_group", "least_upright_landing", "landed"),
    *("turned_landing_rad", "touching_s", "first_touch_down_s", "last_take_off_s"),
}
OF_THE_GROUND = OF_EVENTS | {
    *("standing_end", "peak_ground_force_N", "peak_ground_force_weights", "peak_group_force_N"),
    *("peak_group_force_weights", "peak_foot_force_N", "peak_tail_force_N"),
    *("ground_impulse_N_s", "impulse_N_s", "slip_m"),
}


def strict(told):
    return json.loads(json.dumps(told, allow_nan=False))


def test_the_document_s_table_is_that_of_the_numbers():
    text = (ROOT / "docs" / "simulation.md").read_text(encoding="utf-8")
    table = text.split("<!-- numbers -->\n")[1].split("\n<!-- /numbers -->")[0]
    assert table == numbers.explained(), "give docs/simulation.md the table of numbers.explained()"
    names = [each.name for each in numbers.NUMBERS]
    assert len(set(names)) == len(names) and all(each.meaning for each in numbers.NUMBERS)


def test_text_has_aligned_names_values_and_units(kick):
    told = summary(kick.model, kick)
    lines = str(told).splitlines()
    width = len("peak_group_force_weights, right_foot")
    assert all(line[width : width + 2] == "  " and line[width + 2] != " " for line in lines)
    rows = {line[:width].rstrip(): line[width:] for line in lines}
    assert rows["apex_m"].split() == [f"{told['apex_m']:.5f}", "m"]
    assert rows["peak_ground_force_weights"].endswith("  body weights")
    assert rows["apex_m"].rindex(" m") == rows["duration_s"].rindex(" s")
    assert rows["landed"].strip() == "no" and rows["steps"].strip().isdigit()
    assert rows["peak_tail_force_N"].strip() == "-"
    said = [line.removeprefix("warnings").strip() for line in lines if line.startswith("warn")]
    assert said == kick.warnings


def test_words_and_reports_without_units():
    for value, word in (
        *((0.403754550575, "0.40375"), (764.3260756, "764.33"), (123456.0, "1.2346e+05")),
        *((12345.0, "12345"), (1.0, "1.0000"), (-1e-16, "0.0000"), (1.5e-7, "1.5000e-07")),
        *((957, "957"), (True, "yes"), (None, "-"), ("rk4", "rk4"), ([], "-")),
        ([0.0, -2.5], "0.0000  -2.5000"),
    ):
        assert as_word(value) == word
    report = {"converged": True, "much_longer": 1.0, "parts": {"a": None}, "texts": ["b", "c d"]}
    assert as_text(report).splitlines() == [
        "converged    yes",
        "much_longer  1.0000",
        "parts, a     -",
        "texts        b",
        "texts        c d",
    ]
    assert as_text({}) == ""


def test_markdown_and_json_have_units_and_meanings(kick):
    told = summary(kick.model, kick)
    lines = told.markdown().splitlines()
    assert len(lines) == len(told) + 2 and len({line.count("|") for line in lines}) == 1
    assert lines[0].split() == ["|", "number", "|", "value", "|", "unit", "|", "meaning", "|"]
    (apex,) = (line.split(" | ") for line in lines if "| apex_m |" in line)
    described = strict(told.described())
    assert {name: each["value"] for name, each in described.items()} == strict(told)
    assert apex[1:] == [as_word(told["apex_m"]), "m", described["apex_m"]["meaning"] + " |"]
    assert described["apex_m"]["unit"] == "m" and described["body_weight_N"]["unit"] == "N"


# Runs of other kinds.


def test_a_flight_without_contacts():
    for name in ("m1_n3", "arcs2"):
        model = zoo.model(name)
        motion = st.simulate(model, at_height(model, 0)[0], np.zeros(model.nv), t_span=0.1)
        told = summary(model, motion)
        assert all(told[name] is None for name in OF_THE_GROUND)
        assert told["body_weight_N"] > 1 and told["warnings"] == [] and told["tilt_max_deg"] == 0
        assert strict(told) == told and "peak_ground_force_N" in str(told)


def test_a_body_without_feet(rat):
    motion = made(rat, at_height(rat, 0.1), events=[down("tail", 1.5)])
    rests, forces = np.zeros((2, 3, 3, 3))
    forces[-1, :, 2] = 1.0
    contact = st.Contact(rests, forces, rests[..., :2], {"tail": 2, "torso": 1})
    told = summary(rat, dataclasses.replace(motion, contact=contact))
    assert told["standing_end"] is told["landed"] is told["peak_foot_force_N"] is None
    assert told["least_upright_landing"] == 1 and told["landing_group"] == "tail"
    assert told["peak_group_force_N"] == {"tail": 2.0, "torso": 1.0} and strict(told) == told


def test_a_single_sample(kick):
    arrays = ("t", "q", "v", "tau", "kinetic", "potential", "linear_momentum", "angular_momentum")
    first = {name: getattr(kick, name)[:1] for name in arrays}
    contact = kick.contact.mapped(lambda samples: samples[:1])
    told = summary(kick.model, dataclasses.replace(kick, contact=contact, **first))
    assert told["duration_s"] == told["energy_change_J"] == 0
    assert told["tilt_max_deg"] == told["tilt_end_deg"]
    assert told["landed"] is None and told["peak_ground_force_N"] == pytest.approx(1.07, abs=0.01)
    assert strict(told) == told


def test_a_motion_that_nobody_simulated(rat):
    told = summary(rat, dataclasses.replace(made(rat, at_height(rat, 1.0)), info={}))
    unknown = ("work_J", "imbalance", "impulse_N_s", "cpu_s", "real_time_factor", "touching_s")
    assert all(told[name] is None for name in unknown) and strict(told) == told


def test_a_run_that_failed_has_numbers_and_warnings_up_to_there():
    scene = scene_of("kick")
    with pytest.raises(st.SimulationError) as caught:
        scene.simulate(most_steps=400)
    told = scene.summary(caught.value.trajectory)
    assert told["work_J"] is told["ground_impulse_N_s"] is None
    assert told["peak_ground_force_N"] > 700 and strict(told) == told
    assert {"torso", "ground"} <= {each.split(":")[0] for each in told["warnings"]}


def test_methods_that_look_for_no_events():
    scene = scene_of("kick", duration=0.01)
    for method in ("dop853", "lsoda"):
        told = scene.summary(scene.simulate(method=method, rtol=1e-6, atol=1e-6))
        assert all(told[name] is None for name in OF_EVENTS)
        assert told["ground_impulse_N_s"][2] == pytest.approx(1.0705 * 0.01, rel=1e-2)
        assert told["standing_end"] is True and strict(told) == told

"""Runs beside each other: the table against the numbers of each, the page and the verb."""

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.cli import cli
from tests.motion.conftest import at_height, made, simulated, told
from tests.support import page, zoo
from tests.support.rows import row

from .page.conftest import flown


def by_number(comparison):
    return {each["number"]: each for each in comparison.rows}


def test_rows_have_the_numbers_of_each_run_and_their_differences_to_the_first():
    """Of a jump, and a flight of another tail."""
    runs = {"kick": simulated("kick"), "flight": flown(zoo.model("arcs2"))}
    both, (kick, flight) = st.compare(runs), map(told, runs.values())
    found = by_number(both)
    assert json.loads(json.dumps(both.rows)) == both.rows
    for name in ("apex_m", "tilt_end_deg", "energy_change_J", "steps"):
        with row(name):
            assert found[name]["values"] == {"kick": kick[name], "flight": flight[name]}
            assert found[name]["differences"] == {"flight": flight[name] - kick[name]}
    # parts; what a run lacks is left empty; texts have no difference
    feet = found["impulse_N_s, feet, z"]
    assert feet["values"] == {"kick": kick["impulse_N_s"]["feet"][2], "flight": None}
    assert feet["unit"] == "N s" and set(feet["errors"].values()) == {None}
    for name in ("impulse_N_s, feet, z", "model", "landed"):
        assert found[name]["differences"] == {"flight": None}
    assert found["warnings"]["values"]["kick"] == len(runs["kick"].warnings)


def test_the_table_shows_what_differs_and_names_the_rest():
    low, high = (made(zoo.model("m1_n1"), height) for height in (0.1, 0.25))
    high = dataclasses.replace(high, info=high.info | {"phases": [{"name": "fall", "end": 1.5}]})
    both = st.compare([low, high], names=["low", "high"])
    head, *lines = str(both).splitlines()
    equal = [lines.pop() for _ in range(len(lines) - 2)]
    assert head.split() == ["low", "high", "high", "-", "low", "unit"]
    assert [line.split() for line in lines] == [
        ["apex_m", "0.10000", "0.25000", "+0.15", "m"],
        ["phase_end_s,", "fall", "-", "1.5000", "-", "s"],
    ]
    assert {"duration_s", "warnings"} <= {*re.findall(r"\w+", " ".join(equal))}  # all of them
    assert "phase_end_s" not in repr(both)  # which is shorter
    high = dataclasses.replace(high, info=high.info | {"warnings": ["it fell"]})
    assert str(st.compare({"low": low, "high": high})).endswith("\nhigh: it fell")


def test_errors_if_asked_for_are_those_of_the_summaries():
    runs = [flown(zoo.model("arcs2")), flown(zoo.model("m1_n3"))]
    both = st.compare(runs, errors=True)
    errors = [run.summary(errors=True).errors["tilt_end_deg"] for run in runs]
    assert list(by_number(both)["tilt_end_deg"]["errors"].values()) == errors
    assert all(f"+- {error:.2g}" in repr(both) for error in errors)


def test_what_cannot_be_compared(tmp_path):
    run = made(zoo.model("m1_n1"))
    bare, bad = run.save(tmp_path / "bare.npz"), tmp_path / "bad.npz"
    bad.write_text("bad")
    for motions, how, words in (
        (run, {}, "motions: 1"),
        ([run, run], {"names": ["a", "a"]}, "names: value .*'a', 'a'"),
        ({"a": run, "b": run}, {"names": ["c", "d"]}, "names: given twice"),
        ({"a": run, 3: run}, {}, "names: value .*3"),
        ([run, 7], {}, r"motions\[1\]: type int"),
        ([run, bad], {}, "file: value .*bad.npz"),
        ([run, st.Trajectory.load(bare)], {}, r"motions\[1\]: .*no model"),
        ([run, bare], {"model": "kick"}, "model: value 'kick'"),
    ):
        with row(words), pytest.raises(st.ViewError, match=words):
            st.compare(motions, **how)
    assert "equal: duration_s" in repr(st.compare([run, bare], model=run.model))


def test_the_verb_reads_files_and_writes_page_and_figure(tmp_path, monkeypatch, capsys):
    page.need(page.need_page)
    monkeypatch.chdir(tmp_path)
    model, files = st.build("righting_m1_n3"), ["a.npz", "b.npz"]
    for name, height in zip(files, (0.3, 0.5), strict=True):
        st.simulate(model, at_height(model, height)[0], np.zeros(model.nv), 0.02).save(name)
    both = st.compare(files)
    options = ["--view", "both.html", "--plot", "both.png", "--json", "-"]
    assert cli.main(["compare", *files, *options]) == 0
    assert json.loads(capsys.readouterr().out) == {"runs": files, "rows": both.rows}
    assert [run["name"] for run in page.data_of(Path("both.html"))["runs"]] == files
    assert Path("both.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main(["compare", *files]) == 0 and capsys.readouterr().out == f"{both}\n"
    for words, told_of in (
        (["a.npz"], "motions: 1"),
        (["a.npz", "a.npz"], "names: value"),
        (["a.npz", "c.npz"], "file: value 'c.npz'"),
        (["a.npz", "b.npz", "--plot", "x.bmp"], "--plot x.bmp"),
    ):
        with row(words):
            assert cli.main(["compare", *words]) == 2 and told_of in capsys.readouterr().err

"""Studies: parts that are made once, whatever happens."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

import serpentail as st
from examples.studies.parts import Part, as_flight, as_lists, made
from tests.support import tiny_study, zoo

ROOT = Path(__file__).parents[2]
PATIENCE = 60  # s


def one(folder, of, make, files=()):
    """The result of a part called "one"."""
    return made("study", folder, {"one": Part(make, of, files)})["one"]


def ended(folder):
    """How often each part ended."""
    path = folder / "ended"
    lines = path.read_text().splitlines() if path.exists() else []
    return Counter(int(line.split()[0]) for line in lines)


def test_parts_are_made_once_and_again_where_inputs_change_or_files_are_gone(tmp_path):
    make, picture = partial(tiny_study.square, 3, tmp_path), tmp_path / "picture.png"
    for starts, gone, count in [(2, False, 1), (2, False, 1), (3, False, 2), (3, True, 3)]:
        if gone:
            picture.unlink()
        found = one(tmp_path / "parts", {"starts": (1, starts)}, make, (picture,))
        assert found == {"number": 3, "square": 9, "third": 1.0} and ended(tmp_path) == {3: count}
        picture.touch()
    flight = st.simulate(zoo.model("m1_n1"), [0, 0, 0, 1, 0, 0, 0, 0, 0], np.ones(8), t_span=0.01)
    again = as_flight(as_lists(flight))
    for name in as_lists(flight):
        np.testing.assert_array_equal(getattr(again, name), getattr(flight, name))


def test_a_part_that_fails_is_told_and_none_is_made_while_another_process_writes(tmp_path):
    with pytest.raises(st.SerpentailError, match="one: ZeroDivisionError: no such part"):
        one(tmp_path, {}, tiny_study.wrong)
    assert tiny_study.titles(tmp_path / "study.db") == []
    lock = FileLock(tmp_path / ".study.db.lock")
    with lock, pytest.raises(st.SerpentailError, match="another process is writing"):
        one(tmp_path, {}, tiny_study.ones)
    assert np.isnan(one(tmp_path, {}, tiny_study.lost)["lost"])  # JSON has no NaN of its own


def started(folder):
    """Start the tiny study in a process; one of its parts has begun, when another ends."""
    return subprocess.Popen(
        [sys.executable, "-m", "tests.support.tiny_study", str(folder)],
        cwd=ROOT,
        env=os.environ | {"SERPENTAIL_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.parametrize("whole", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_ctrl_c_ends_all_in_one_line_and_the_same_command_goes_on(tmp_path, whole):
    """From a terminal all processes hear it, from another program the parent alone."""
    store, process = tmp_path / "parts" / "tiny.db", started(tmp_path)
    while not tiny_study.titles(store):
        time.sleep(0.02)
    (os.killpg if whole else os.kill)(process.pid, signal.SIGINT)
    printed, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and printed == ""
    *told, last = errors.splitlines()
    assert last == "interrupted: the same command goes on from here"
    assert [line for line in told if not line.startswith("sweep")] == []
    counts, kept = ended(tmp_path), [int(title.split()[1]) for title in tiny_study.titles(store)]
    printed, _ = started(tmp_path).communicate(timeout=PATIENCE)
    parts = range(tiny_study.PARTS)
    results = [(f"part {k}", {"number": k, "square": k**2, "third": k / 3}) for k in parts]
    assert printed == f"{results}\n"
    assert all(ended(tmp_path)[k] == counts[k] for k in kept) and {*ended(tmp_path)} == {*parts}

"""Parts of studies: made side by side, each once whatever happens; kept ones are read, and made
anew exactly where what they depend on has changed.
"""

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
from examples.studies.parts import Part, as_flight, as_lists, digest, made
from tests.support import tiny_study, zoo

ROOT = Path(__file__).parents[2]
PATIENCE = 60  # s


def one(folder, of, make, files=()):
    """The result of a part called "one"."""
    return made("study", folder, {"one": Part(make, of, files)})["one"]


def runs(folder):
    """How often the part was made."""
    path = folder / "ended"
    return len(path.read_text().splitlines()) if path.exists() else 0


def test_parts_are_made_once_and_again_where_inputs_change_or_files_are_gone(tmp_path):
    make, picture = partial(tiny_study.square, 3, tmp_path), tmp_path / "picture.png"
    for starts, gone, count in [(2, False, 1), (2, False, 1), (3, False, 2), (3, True, 3)]:
        if gone:
            picture.unlink()
        found = one(tmp_path / "parts", {"starts": (1, starts)}, make, (picture,))
        assert found == {"number": 3, "square": 9, "third": 1.0} and runs(tmp_path) == count
        picture.touch()


def test_a_part_that_fails_is_told_and_none_is_made_while_another_process_writes(tmp_path):
    with pytest.raises(st.SerpentailError, match="one: ZeroDivisionError: no such part"):
        one(tmp_path, {}, tiny_study.wrong)
    assert tiny_study.titles(tmp_path / "study.db") == []
    lock = FileLock(tmp_path / ".study.db.lock")
    with lock, pytest.raises(st.SerpentailError, match="another process is writing"):
        one(tmp_path, {}, tiny_study.ones)
    assert np.isnan(one(tmp_path, {}, tiny_study.lost)["lost"])  # JSON has no NaN of its own


# what the tiny study prints
RESULTS = str(
    [(f"part {k}", {"number": k, "square": k**2, "third": k / 3}) for k in range(tiny_study.PARTS)]
)


def started(folder, threads="3", **settings):
    """Start the tiny study in processes."""
    folder.mkdir(exist_ok=True)
    return subprocess.Popen(
        [sys.executable, "-m", "tests.support.tiny_study", str(folder)],
        cwd=ROOT,
        env=os.environ | {"SERPENTAIL_THREADS": threads},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **settings,
    )


def ended(folder):
    """How often each part ended, and in which processes parts did."""
    path = folder / "ended"
    rows = [line.split() for line in path.read_text().splitlines()] if path.exists() else []
    return Counter(int(number) for number, _ in rows), {pid for _, pid in rows}


@pytest.mark.slow
def test_parts_side_by_side_are_those_one_after_the_other(tmp_path):
    process = started(tmp_path / "many")
    printed, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, printed) == (0, RESULTS + "\n"), errors
    counts, processes = ended(tmp_path / "many")
    assert counts == dict.fromkeys(range(tiny_study.PARTS), 1)
    assert 2 <= len(processes) <= 3 and str(process.pid) not in processes


def test_a_study_that_is_killed_goes_on_and_makes_no_part_twice(tmp_path):
    folder = tmp_path / "many"
    store, process = folder / "parts" / "tiny.db", started(folder)
    while len(tiny_study.titles(store)) < 3:
        time.sleep(0.02)
    process.kill()
    process.communicate(timeout=PATIENCE)  # ends when the workers have, which hold its pipes
    counts = ended(folder)[0]
    kept = {k: counts[k] for k in (int(title.split()[1]) for title in tiny_study.titles(store))}
    printed, errors = started(folder).communicate(timeout=PATIENCE)
    assert printed == RESULTS + "\n", errors
    counts = ended(folder)[0]
    assert {k: counts[k] for k in kept} == kept and len(counts) == tiny_study.PARTS


@pytest.mark.parametrize("whole", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_ctrl_c_ends_all_in_one_line(tmp_path, whole):
    """From a terminal all processes hear it, from another program the parent alone."""
    folder = tmp_path / "many"
    process = started(folder, "1", start_new_session=True)  # one that has begun, when parts end
    while not tiny_study.titles(folder / "parts" / "tiny.db"):
        time.sleep(0.02)
    (os.killpg if whole else os.kill)(process.pid, signal.SIGINT)
    printed, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and printed == ""
    *told, last = errors.splitlines()
    assert last == "interrupted: the same command goes on from here"
    assert [line for line in told if not line.startswith("sweep")] == []


def test_digests_follow_the_sources(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    before = digest(tmp_path)
    (tmp_path / "notes.md").write_text("words")
    assert digest(tmp_path) == before
    (tmp_path / "a.py").write_text("x = 2\n")
    assert (changed := digest(tmp_path)) != before
    (tmp_path / "native.c").write_text("int x;\n")
    assert digest(tmp_path) != changed


def test_flights_come_back_bit_for_bit():
    flight = st.simulate(zoo.model("m1_n1"), [0, 0, 0, 1, 0, 0, 0, 0, 0], np.ones(8), t_span=0.01)
    again = as_flight(as_lists(flight))
    for name in as_lists(flight):
        np.testing.assert_array_equal(getattr(again, name), getattr(flight, name))

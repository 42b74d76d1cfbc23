"""The processes that run points: what starts, hangs, crashes and ends in them."""

import os
import subprocess
import sys
from functools import partial

import pytest

import serpentail as st
from serpentail.bridges.sweeps import processes
from serpentail.bridges.sweeps.result import Status
from tests.support import swept


@pytest.mark.slow
def test_programs_need_no_main_guard(tmp_path):
    """Workers do not import the program that calls the sweep: its own functions travel whole."""
    script = tmp_path / "script.py"
    script.write_text(
        "import math\nimport serpentail as st\n"
        "def own(point):\n    return {'root': other(point['x'])}\n"
        "def other(x):\n    return math.sqrt(x)\n"
        "for executor in ('dask', 'processes:1'):\n"
        "    rows = st.sweep(None, {'x': st.grid([9])}, own, executor=executor)\n"
        "    print([row['root'] for row in rows])\n"
    )
    given = {"capture_output": True, "text": True, "timeout": 120}
    found = subprocess.run([sys.executable, script], check=True, **given)
    assert found.stdout == "[3.0]\n[3.0]\n" and found.stderr == ""


def test_ctrl_c_is_for_the_driver_alone():
    """A terminal sends it to all processes of the driver's group."""
    process = processes.Process()
    try:
        assert os.getpgid(process.child.pid) != os.getpgid(0)
    finally:
        process.end()


def test_points_that_hang_crash_or_raise_are_rows(worker, tmp_path):
    run = partial(swept.troubled, 0.0, str(tmp_path / "log"))
    failing = {swept.HANGS[0]: "TimeLimit", swept.RAISES[0]: "ValueError: no such number"}
    failing |= dict.fromkeys(swept.CRASHES, "ProcessEnded")
    over = {"number_of": st.grid([1, *failing, 2])}
    found = st.sweep(None, over, run, limit=1.0, executor=worker)
    for row in found.rows():
        if row["number_of"] in failing:
            assert row["error"].startswith(failing[row["number_of"]])
        else:
            assert row["error"] is None and row["twice"] == 2 * row["number_of"]
    log = (tmp_path / "log").read_text().split()
    crashed = [log.count(str(number)) for number in swept.CRASHES]
    assert found.status().failed == 4 and set(crashed) <= {2, 3}  # once with others, twice alone


def test_a_limit_is_of_processor_time_and_what_sleeps_is_given_up_without_a_row(worker, tmp_path):
    run = partial(swept.troubled, 0.4, str(tmp_path / "log"))  # s on the clock
    over = {"number_of": st.grid([1, *swept.SLEEPS])}
    found = st.sweep(None, over, run, limit=0.05, executor=worker)
    assert found[0]["error"] is None and found[0]["seconds"] >= 0.4
    assert found.status() == Status(2, 1, 0) and found.spent.hung == 1

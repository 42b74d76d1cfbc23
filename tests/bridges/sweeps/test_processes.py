"""The processes that run points: what starts, hangs, crashes and ends in them."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

import serpentail as st
from serpentail.bridges.sweeps import processes
from serpentail.bridges.sweeps.result import Status
from tests.support import swept

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_dask_needs_no_main_guard_and_functions_of_the_program_tell_that_they_do(tmp_path):
    """A sweep without a guard would begin another one in each worker."""
    script = tmp_path / "script.py"
    own = {"cwd": ROOT, "env": os.environ | {"PYTHONPATH": str(ROOT)}}
    for run, told in (("swept.square", ""), ("own", 'the line if __name__ == "__main__":')):
        script.write_text(
            "import serpentail as st\nfrom tests.support import swept\ndef own(point): return {}\n"
            f"st.sweep(None, {{'x': st.grid([3])}}, {run}, executor='dask')\n"
        )
        given = own | {"capture_output": True, "text": True, "timeout": 120}
        found = subprocess.run([sys.executable, script], check=False, **given)
        assert found.returncode == bool(told) and found.stdout == "", found.stderr
        assert "".join(found.stderr.splitlines()[-1:]).endswith(told)
        assert len(found.stderr.splitlines()) < 25


def test_a_worker_process_does_not_hear_ctrl_c_while_it_starts(capfd):
    process = processes.Process()
    try:
        for _ in range(20):
            process.child.send_signal(signal.SIGINT)
            time.sleep(0.02)
        assert process.child.poll() is None
    finally:
        process.end()
    assert capfd.readouterr().err == ""


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
    assert crashed == [2, 2] and log.count(str(swept.HANGS[0])) == 1 and found.status().failed == 4


def test_a_limit_is_of_processor_time_and_what_sleeps_is_given_up_without_a_row(
    worker, tmp_path, monkeypatch
):
    run = partial(swept.troubled, 0.4, str(tmp_path / "log"))  # s on the clock
    over = {"number_of": st.grid([1, *swept.SLEEPS])}
    found = st.sweep(None, over, run, limit=0.15, executor=worker)
    assert found[0]["error"] is None and found[0]["seconds"] >= 0.4
    assert found.status() == Status(2, 1, 0) and found.spent.hung == 1
    monkeypatch.setattr(processes, "HANGS", 0.3)  # as where many others are at work
    monkeypatch.setattr(processes, "LEAST", 1e-3)
    over = {"number_of": st.grid(swept.HANGS)}
    found = st.sweep(None, over, run, limit=0.5, executor=worker)  # but it does not hang
    assert found[0]["error"].startswith("TimeLimit")

"""Batches, runs, CasADi's functions and plans give the same digits in children, pools, threads."""

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

from tests.support import zoo

from .forks import MOMENTS
from .jobs import JOBS
from .ways import WAYS

LIMIT = 500.0  # s, then all processes of a test are killed
QUICK = ("fork", "threads", "at rest", "beside rollouts", "beside the compiler")
BESIDE = [name for name in MOMENTS if name.startswith("beside")]  # where chance decides


@pytest.mark.parametrize(
    "ways", [QUICK, pytest.param([*WAYS, *10 * BESIDE], marks=pytest.mark.slow)]
)
def test_every_job_is_the_same_elsewhere(ways):
    zoo.model("m1_n3")  # compiled
    command = [sys.executable, "-m", "tests.processes.ways", zoo.folder("m1_n3"), *ways]
    environment = os.environ | {"SERPENTAIL_THREADS": "2"}  # in workers of pools, too
    running = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        said, _ = running.communicate(timeout=LIMIT)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(running.pid, signal.SIGKILL)
        running.wait()
    assert running.returncode == 0, said
    found = [json.loads(line) for line in said.splitlines()]
    expected = {
        way: dict.fromkeys(JOBS, ["same"] if way in MOMENTS else ["same", "same"]) for way in ways
    }
    assert found == [{way: expected[way]} for way in ways]

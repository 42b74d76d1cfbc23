"""Batches, runs, CasADi's functions and plans give the same digits in children, pools, threads."""

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

from tests.support.tumbling import rat

from .forks import MOMENTS
from .jobs import JOBS
from .ways import WAYS

LIMIT = 120.0  # s, then all processes of a test are killed


def told(*words: str) -> list[dict]:
    """Return the JSON lines that a module of this room prints."""
    command = [sys.executable, "-m", *words]
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
    return [json.loads(line) for line in said.splitlines()]


@pytest.mark.parametrize("way", WAYS)
def test_every_job_is_the_same_elsewhere(way):
    found = told("tests.processes.ways", way, str(rat().folder))
    assert found == [{name: ["same", "same"]} for name in JOBS]


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_forked_child_does_every_job(moment):
    found = told("tests.processes.forks", moment, str(rat().folder))
    assert found == [dict.fromkeys(JOBS, "same")]


@pytest.mark.slow
@pytest.mark.parametrize("moment", MOMENTS)
def test_many_forked_children_do_every_job(moment):
    found = told("tests.processes.forks", moment, str(rat().folder), "20")
    assert found == [dict.fromkeys(JOBS, "same")] * 20

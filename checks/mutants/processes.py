"""Runs processes of tests; when one ends, so do all processes that it started."""

import contextlib
import os
import signal
import subprocess
import threading
import time
from pathlib import Path

stopped = threading.Event()  # set when the run of mutants is interrupted
TICK = 0.2  # s


class Stopped(Exception):
    """The run of mutants was interrupted, so what a process of tests did says nothing."""


def run(words: list[str], cwd: Path, env: dict, limit: float) -> tuple[int | None, str]:
    """Run a process; return its status, or None if it took too long (s), and its output."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    end, output = time.monotonic() + limit, None
    with subprocess.Popen(words, cwd=cwd, env=env, start_new_session=True, **pipes) as process:
        try:
            while output is None and time.monotonic() < end and not stopped.is_set():
                with contextlib.suppress(subprocess.TimeoutExpired):
                    output, _ = process.communicate(timeout=TICK)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    if stopped.is_set():
        raise Stopped
    return (None, "") if output is None else (process.returncode, output)

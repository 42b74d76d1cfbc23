"""Runs processes of tests; when one ends, so do all processes that it started."""

import contextlib
import os
import signal
import subprocess
import threading
from pathlib import Path

stopped = threading.Event()
running: set[subprocess.Popen] = set()


class Stopped(Exception):
    """The run of mutants was interrupted, so what a process of tests did says nothing."""


def run(words: list[str], cwd: Path, env: dict, limit: float) -> tuple[int | None, str]:
    """Run a process; return its status, or None if it took too long, and its output.

    Stopped if ``stop`` ended it, or was called before.
    """
    if stopped.is_set():
        raise Stopped
    begun = subprocess.Popen(
        words,
        cwd=cwd,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    with begun as process:
        running.add(process)
        if stopped.is_set():  # since it was asked above
            kill(process)
        try:
            output, _ = process.communicate(timeout=limit)
            found = process.returncode, output
        except subprocess.TimeoutExpired:
            found = None, ""
        finally:
            kill(process)
            running.discard(process)
    if stopped.is_set():
        raise Stopped
    return found


def stop() -> None:
    """End all processes, also those of other threads, and let none begin."""
    stopped.set()
    for process in tuple(running):
        kill(process)


def kill(process: subprocess.Popen) -> None:
    """End a process and those that it started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)

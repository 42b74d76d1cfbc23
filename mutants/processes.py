"""Runs processes of tests; when one ends, so do all processes that it started."""

import contextlib
import os
import signal
import subprocess
from pathlib import Path


def run(words: list[str], cwd: Path, env: dict, limit: float) -> tuple[int | None, str]:
    """Run a process; return its status, or None if it took too long, and its output."""
    process = subprocess.Popen(
        words,
        cwd=cwd,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        output, _ = process.communicate(timeout=limit)
        return process.returncode, output
    except subprocess.TimeoutExpired:
        return None, ""
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

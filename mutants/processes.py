"""Processes of tests, which end with all that they started."""

import contextlib
import os
import signal
import subprocess
from pathlib import Path


def run(words: list[str], cwd: Path, env: dict, limit: float) -> tuple[int | None, str]:
    """Return a process's status, None if it took too long, and its output; end what it started."""
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

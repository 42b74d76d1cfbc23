"""Programs of Python that do not outlive their test."""

import os
import signal
import subprocess
import sys
from contextlib import suppress

import pytest


@pytest.fixture
def child():
    """Return a function that starts one."""
    begun = []

    def started(*words, **settings):
        pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
        settings |= pipes | {"text": True, "start_new_session": True}
        begun.append(subprocess.Popen([sys.executable, *map(str, words)], **settings))
        return begun[-1]

    yield started
    for process in begun:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

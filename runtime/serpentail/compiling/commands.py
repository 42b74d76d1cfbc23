"""Runs commands side by side, and leaves none of them behind."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress

TICK_S = 0.2  # s between checks of a command's progress
GRACE_S = 0.5  # s that a command has to remove its temporary files
Finished = subprocess.CompletedProcess[str]


def inherited(**more: str) -> dict[str, str]:
    """Return the environment of a Python process that finds the modules that this one does.

    more: variables to set besides.
    """
    paths = dict.fromkeys(path or os.getcwd() for path in sys.path)
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths)} | more


def run_all(
    commands: Sequence[Sequence[str]],
    environment: Mapping[str, str],
    tick: Callable[[], object] = lambda: None,
) -> list[Finished]:
    """Return the finished commands; OSError if one cannot be started.

    tick: called now and then while they run. After Ctrl-C or an error, the commands and their
    children are ended.
    """
    finished = []
    with ExitStack() as running:
        for process in [running.enter_context(_running(each, environment)) for each in commands]:
            while process.returncode is None:
                with suppress(subprocess.TimeoutExpired):
                    output = process.communicate(timeout=TICK_S)
                tick()
            finished.append(Finished(process.args, process.returncode, *output))
    return finished


@contextmanager
def _running(
    command: Sequence[str], environment: Mapping[str, str]
) -> Iterator[subprocess.Popen[str]]:
    """Run a command in its own process group; at the end nothing of it is left."""
    with subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        process_group=0,  # Windows has no sessions, and ignores it
    ) as process:
        try:
            yield process
        finally:
            if process.returncode is None:
                _end(process)


def _end(process: subprocess.Popen[str]) -> None:
    """End a process and what it has started: a compiler's driver leaves the compiler to itself."""
    if not hasattr(os, "killpg"):  # on Windows
        process.kill()
        return
    os.killpg(process.pid, signal.SIGTERM)
    with suppress(subprocess.TimeoutExpired):
        process.wait(GRACE_S)
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)

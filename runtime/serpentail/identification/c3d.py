"""Reads C3D files by ezc3d in a child process with limits, so that no file can harm this one."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np

from serpentail_scene.messages import one_line

from ..basics.errors import IdentificationError
from ..basics.extras import needed
from ..compiling.commands import inherited

CHILD = Path(__file__).with_name("c3d_child.py")
MEMORY = (2**30, 64)  # bytes that a read may use: at least, and for each byte of the file
SPEED = 1e6  # bytes of a file in a second of processor time: a tenth of what is usual
SECONDS = 3  # of processor time, at least
WAIT = 6  # s for each s of processor time: the machine may be busy
REMEDY = "export it again, or save it as TRC or CSV"


def read_c3d(source: Path) -> tuple[np.ndarray, np.ndarray, list[str], str | None]:
    """Return times, positions, names and unit of a file; nan for markers that were not seen.

    IdentificationError if it cannot be read, ExtraMissing without ezc3d.
    """
    line, _, numbers = _answer(source).partition(b"\n")
    try:
        told = json.loads(line)
        if "missing" in told:
            needed("ezc3d", "c3d")
        if "error" in told:
            raise ValueError(told["error"])
        positions = np.frombuffer(numbers, "<f8").reshape(told["shape"])
        rate, first = told["rate"], told["first"]
        if not 0 < rate < np.inf:
            raise ValueError(f"POINT:RATE is {rate}")
    except ValueError as error:
        raise _refused(source, str(error)) from None
    times = (first + np.arange(len(positions))) / rate
    return times, positions, told["names"][: positions.shape[1]], told["unit"]


def _answer(source: Path) -> bytes:
    """Return what the child writes about a file: a line of JSON, and the bytes of its positions."""
    size = source.stat().st_size
    seconds = SECONDS + int(size / SPEED)
    command = [sys.executable, "-P", str(CHILD), str(source.absolute())]
    command += [str(MEMORY[0] + MEMORY[1] * size), str(seconds)]
    try:
        done = subprocess.run(
            command,
            # threads of NumPy would need memory, and there is nothing to do for them
            env=inherited(OPENBLAS_NUM_THREADS="1"),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=WAIT * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _refused(source, f"no answer in {WAIT * seconds} s") from None
    if done.returncode:
        raise _refused(source, f"reading it ended with {_end(done.returncode)}")
    return done.stdout


def _end(status: int) -> str:
    """Return how a process ended."""
    return signal.Signals(-status).name if status < 0 else f"status {status}"


def _refused(source: Path, reason: str) -> IdentificationError:
    """Return the error about a damaged file."""
    line = one_line(reason)
    return IdentificationError(f"{source}: is not a complete C3D file ({line}): {REMEDY}")

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
from .tracks import RawTracks

CHILD = Path(__file__).with_name("c3d_child.py")
MEMORY = (2**30, 64)  # bytes that a read may use: at least, and for each byte of the file
SPEED = 1e6  # bytes of a file in a second of processor time: a tenth of what is usual
SECONDS = 3  # of processor time, at least
WAIT = 6  # s for each s of processor time: the machine may be busy
REMEDY = "export it again, or save it as TRC or CSV"


def read_c3d(source: Path) -> RawTracks:
    """Return the tracks of a file; nan for markers that were not seen.

    IdentificationError if it cannot be read, ExtraMissing without ezc3d.
    """
    line, _, numbers = _answer(source).partition(b"\n")
    try:
        answer = json.loads(line)
        if "missing" in answer:
            needed("ezc3d", "c3d")
        if "error" in answer:
            raise ValueError(answer["error"])
        positions = np.frombuffer(numbers, "<f8").reshape(answer["shape"])
        rate, first = answer["rate"], answer["first"]
        if not 0 < rate < np.inf:
            raise ValueError(f"POINT:RATE is {rate}")
    except ValueError as error:
        raise _refused(source, str(error)) from None
    times = (first + np.arange(len(positions))) / rate
    return RawTracks(times, positions, answer["names"][: positions.shape[1]], answer["unit"])


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
        status = done.returncode
        end = signal.Signals(-status).name if status < 0 else f"status {status}"
        raise _refused(source, f"reading it ended with {end}")
    return done.stdout


def _refused(source: Path, reason: str) -> IdentificationError:
    """Return the error about a damaged file."""
    line = one_line(reason)
    return IdentificationError(f"{source}: is not a complete C3D file ({line}): {REMEDY}")

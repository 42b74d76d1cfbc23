"""Reads a C3D file in a process of its own, because damaged files can end ezc3d by a signal.

It is run by its path: nothing of serpentail is imported. It writes a line of JSON, then the numbers
of the positions.
"""

import json
import os
import sys
from contextlib import suppress
from typing import Any, BinaryIO


def limit(what: str, most: int) -> None:
    """Limit what this process may use, unless the system has no such limit or a lower one."""
    with suppress(ImportError, AttributeError, ValueError, OSError):  # Windows has none
        import resource

        resource.setrlimit(getattr(resource, f"RLIMIT_{what}"), (most, most))


def main(path: str, memory: int, seconds: int, answer: BinaryIO) -> None:
    """Write what a file holds: memory in bytes, seconds of processor time."""
    try:
        import ezc3d
        import numpy as np
    except ImportError as error:
        tell(answer, {"missing": True, "error": str(error)})
        return
    limit("CORE", 0)
    limit("AS", memory)
    limit("CPU", seconds)
    try:
        content = ezc3d.c3d(path)
        point = content["parameters"]["POINT"]
        positions = np.moveaxis(content["data"]["points"][:3], [0, 1, 2], [2, 1, 0])
        units = point["UNITS"]["value"]
        summary = {
            "names": [str(name).strip() for name in point["LABELS"]["value"]],
            "rate": float(point["RATE"]["value"][0]),
            "unit": str(units[0]) if units else None,
            "first": int(content["header"]["points"]["first_frame"]),
            "shape": positions.shape,
        }
    except Exception as error:  # ezc3d raises errors of many kinds for damaged files
        tell(answer, {"error": f"{type(error).__name__}: {error!s:.100}"})
        return
    tell(answer, summary)
    answer.write(np.ascontiguousarray(positions, "<f8").data)


def tell(answer: BinaryIO, summary: dict[str, Any]) -> None:
    """Write a line of JSON."""
    answer.write(json.dumps(summary).encode() + b"\n")


if __name__ == "__main__":
    with os.fdopen(os.dup(1), "wb") as stream:
        os.dup2(2, 1)  # what libraries print is no part of the answer
        main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), stream)

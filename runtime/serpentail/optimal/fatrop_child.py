"""Gives FATROP one setting, in a process of its own: one that it does not know ends the process.

It is run by its path, and nothing of serpentail is imported. Its arguments are the library of the
stages, FATROP's, the setting, and the names of the functions that are called. It writes ASKED once
FATROP is about to be asked; its exit code is 0 if FATROP has the setting.
"""

import contextlib
import ctypes
import sys

ASKED = "asked"


def main(stages: str, fatrop: str, setting: str, *names: str) -> int:
    """Return the exit code."""
    own, library = ctypes.CDLL(stages), ctypes.CDLL(fatrop)
    functions = [ctypes.cast(getattr(library, name), ctypes.c_void_p) for name in names]
    called = (ctypes.c_void_p * len(functions))(*functions)
    with contextlib.suppress(ImportError, ValueError, OSError):  # Windows has no such limits
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print(ASKED, flush=True)
    return own.fatrop_takes(called, setting.encode())


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

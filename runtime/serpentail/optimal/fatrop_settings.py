"""Which settings FATROP has besides those that it lists, asked for once in a child process.

The answer is kept in the cache, by CasADi's version and FATROP's library.
"""

import contextlib
import ctypes
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

from ..basics.errors import SerpentailError
from ..compiling.cache import SOLVERS, cache_folder, digest, read_note, write_note
from .fatrop_child import ASKED
from .library import kernel

CHILD = Path(__file__).with_name("fatrop_child.py")
PATIENCE_S = 20.0  # s; it takes 0.06 s of an idle machine


@cache
def has_setting(fatrop: ctypes.CDLL, setting: str, names: tuple[str, ...]) -> bool:
    """Tell if FATROP has a setting that is a double; False also if no child process can tell.

    names: of FATROP's functions, in the order of Library in native/fatrop.c.
    """
    import casadi as ca

    status, folder = os.stat(fatrop._name), cache_folder()
    # which changes if the library is replaced
    file = [os.path.realpath(fatrop._name), status.st_size, status.st_mtime_ns]
    key = digest(["fatrop", ca.CasadiMeta.version(), file, setting])
    noted = read_note(folder, SOLVERS, key)
    if noted is not None:
        return noted
    found = _asked(fatrop, setting, names)
    if found is not None:
        with contextlib.suppress(SerpentailError):  # it is asked again
            write_note(folder, SOLVERS, key, found)
    return bool(found)


def _asked(fatrop: ctypes.CDLL, setting: str, names: tuple[str, ...]) -> bool | None:
    """Ask a child process; None if it did not come to ask FATROP."""
    if getattr(sys, "frozen", False) or not sys.executable:  # it would start another program
        return None
    command = [sys.executable, "-I", "-S", str(CHILD), kernel()._name, fatrop._name, setting]
    try:
        done = subprocess.run(
            [*command, *names],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.returncode == 0 if done.stdout.startswith(ASKED) else None

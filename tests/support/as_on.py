"""Runs a command as on a lesser processor: `as_on.py x86-64-v3 COMMAND ...`.

The instructions at hand decide how sums round: a fused multiply-add, or eight numbers at a time in
place of four, changes a last digit. NumPy, OpenBLAS, the C library and the compiler of the models
each choose for themselves, so each is told to keep to a level of the x86-64 ABI.
"""

import os
import platform
import shlex
import sys
from pathlib import Path

import numpy as np

X86 = ("x86_64", "AMD64")
# Of each level: its kernels in OpenBLAS; what is beyond it, in NumPy's words and the C library's.
LEVELS = {
    "x86-64-v3": ("Haswell", ("AVX512", "X86_V4"), ""),
    "x86-64-v2": ("Prescott", ("AVX512", "X86_V4", "AVX2", "FMA3", "X86_V3"), "-AVX2,-FMA"),
}


def surroundings(level: str) -> dict[str, str]:
    """Return an environment in which all who choose instructions keep to a level."""
    openblas, beyond, switched_off = LEVELS[level]
    # NumPy refuses names of kernels that it does not have or that this processor cannot run.
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", ())
    disabled = os.environ.get("NPY_DISABLE_CPU_FEATURES", "").split()
    disabled += [name for name in found if name.startswith(beyond)]
    chosen = {
        "NPY_DISABLE_CPU_FEATURES": " ".join(disabled),
        "OPENBLAS_CORETYPE": openblas,
        "CC": shlex.join([str(Path(__file__).with_name("cc_on").absolute()), level]),
    }
    if switched_off:
        chosen["GLIBC_TUNABLES"] = f"glibc.cpu.hwcaps={switched_off}"
    return {**os.environ, **chosen}


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in LEVELS:
        sys.exit(f"usage: as_on.py {{{','.join(LEVELS)}}} COMMAND ...")
    if platform.machine() not in X86:
        print("as_on.py: not an x86-64 processor: the command runs as it is", file=sys.stderr)
        os.execvp(sys.argv[2], sys.argv[2:])
    os.execvpe(sys.argv[2], sys.argv[2:], surroundings(sys.argv[1]))

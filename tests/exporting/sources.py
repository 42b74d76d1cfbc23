"""Compiles the sources of an FMU as strictly as a compiler can."""

import subprocess
from pathlib import Path


def compiled(unzipped, folder, *options):
    """The library of the sources, by a compiler that has no complaint."""
    sources = sorted(Path(unzipped, "sources").glob("*.c"))
    library = folder / "unit.so"
    flags = ["-std=c99", "-O1", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    command = [
        "cc",
        *flags,
        "-fvisibility=hidden",
        *options,
        *map(str, sources),
        "-o",
        str(library),
        "-lm",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return library

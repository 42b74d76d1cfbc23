"""Compiles a model's C for other platforms by ziglang's clang, and runs what can be run here.

Every source is compiled with all warnings as errors, in the profile "reproducible", and linked into
a shared library. The model's example is linked into a program. Where this machine or an emulator on
PATH runs it, what it prints must equal what it prints here, digit by digit.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from examples import front

# zig's name of a platform, and what runs its programs here: itself, an emulator, or nothing
PLATFORMS = {
    "x86_64-linux-gnu": "env",
    "x86_64-linux-musl": "env",
    "aarch64-linux-gnu": "",
    "aarch64-linux-musl": "qemu-aarch64",  # linked statically, so that no C library is needed
    "x86_64-macos": "",
    "aarch64-macos": "",
    "x86_64-windows-gnu": "",
    "aarch64-windows-gnu": "",
}


def main(folder: Path) -> int:
    """Print a line for each platform; return the exit status."""
    expected, failed = None, False
    with tempfile.TemporaryDirectory() as scratch:
        for platform, emulator in PLATFORMS.items():
            told, printed = tried(folder, platform, emulator, Path(scratch))
            expected = expected or printed
            if printed not in (None, expected):
                told = f"DIFFERS: {printed}"
            failed |= told[0].isupper()
            print(f"{platform:20} {told}", flush=True)
    return int(failed)


def tried(folder: Path, platform: str, emulator: str, scratch: Path) -> tuple[str, str | None]:
    """Return what to tell of a platform, and what the example printed, None if it did not run."""
    from serpentail.compiling.toolchain import PROFILES

    words = (sys.executable, "-m", "ziglang", "cc", "-target", platform, *PROFILES["reproducible"])
    words += ("-Wall", "-Wextra", "-Werror", f"-I{folder / 'include'}")
    words += () if "windows" in platform else ("-fPIC",)
    library, program = scratch / f"{platform}.so", scratch / f"{platform}.exe"
    model = (folder / "example" / "main.c", folder / "src" / f"{folder.name}.c")
    sources = ("-shared", *sorted((folder / "src").glob("*.c")))
    for made, of in ((library, sources), (program, model)):
        done = subprocess.run(
            (*words, *of, "-lm", "-o", made), capture_output=True, text=True, check=False
        )
        if done.returncode:
            return f"FAILED: {done.stderr[:2000]}", None
    told = f"compiled, library of {library.stat().st_size / 1024:.0f} kB"
    if not emulator or not shutil.which(emulator):
        return f"{told}, not run", None
    done = subprocess.run((emulator, program), capture_output=True, text=True, check=True)
    return f"{told}, example run with the same digits", done.stdout


if __name__ == "__main__":
    parser = front.parser(__doc__)
    parser.add_argument("folder", type=Path, help="generated folder")
    front.run(main, parser.parse_args().folder)

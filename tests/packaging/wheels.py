"""Builds the sdist, of it the wheel, tells what is wrong, and uses it in each Python here."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from email import message_from_bytes
from pathlib import Path

from examples import front

ROOT = Path(__file__).parents[2]
PAGE = "serpentail/show/page/page.html"
PARTS = {  # where the sources of a wheel's folders are, and which files of them it has
    "serpentail_codegen": (ROOT / "codegen" / "serpentail_codegen", ("*.py", "*.jinja", "*.typed")),
    "serpentail_scene": (ROOT / "codegen" / "serpentail_scene", ("*.py", "*.typed")),
    "serpentail": (ROOT / "runtime" / "serpentail", ("*.py", "*.pyi", "*.[ch]", "*.cc", "*.typed")),
    "serpentail/examples": (ROOT / "scenes", ("*.toml",)),
}
LICENCES = ("MIT License", "three.js authors", "Leon Sorokin")  # ours, and of the page's libraries
VERSIONS = ("3.11", "3.12", "3.13")
PROGRAM = """
import numpy as np, serpentail as st
wanted = ["forward_dynamics", "rollout", "energy", "momentum"]
model = st.build(tail="articulated", segments=1, links=2, functions=wanted)
flight = st.simulate(model, [0, 0, 1, 1, 0, 0, 0, 0, 0], np.zeros(8), t_span=0.1)
assert abs(flight.q[-1, 2] - (1 - 9.8 / 2 * 0.1**2)) < 1e-9, flight.q[-1, 2]
"""
MADE = ("generated/articulated_m1_n1/articulated_m1_n1_casadi.py", "kick.html")
WORKS = (  # without any extra
    ["serpentail", "--version"],
    ["serpentail", "examples"],
    ["serpentail", "simulate", "kick", "--json", "-", "--save", "kick.npz"],
    ["serpentail", "view", "kick.npz"],
    ["serpentail", "verify", "kick"],
    ["serpentail", "info", "righting_m1_n3"],
    ["serpentail", "generate", "--tail", "articulated", "--segments", "1", "--links", "1"],
    ["python", "-c", PROGRAM],
)
REFUSED = {  # what names the extra that it needs
    "plan": ["serpentail", "plan", "righting_m1_n3"],
    "plot": ["serpentail", "simulate", "kick", "--film", "kick.png"],
    "completion": ["serpentail", "completion", "bash"],
}
UV = shutil.which("uv")


def main(folder: Path) -> int:
    wheel = build(folder)
    tell_all = faults(wheel, page=True)
    with tempfile.TemporaryDirectory() as scratch:
        for version in VERSIONS:
            python = interpreter(version)
            if python is None:
                print(f"Python {version}: is not here, so the wheel was not tried", flush=True)
                continue
            found = tried(wheel, python, Path(scratch) / version, Path(scratch) / "cache")
            tell_all += [f"Python {version}: {fault}" for fault in found]
            print(f"Python {version}: {'FAILED' if found else 'works'}", flush=True)
    print(*tell_all, sep="\n", end="\n" if tell_all else "")
    return 1 if tell_all else 0


def faults(wheel: Path, page: bool) -> list[str]:
    """Return what is wrong with a wheel, a line each; page: whether it should have the page."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (metadata,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        text = message_from_bytes(archive.read(metadata)).get_payload()
        licences = [archive.read(name).decode() for name in names if name.endswith("/LICENSE")]
        licences += [archive.read(PAGE).decode()] if PAGE in names else []
    wanted = {PAGE} if page else set()
    for place, (folder, patterns) in PARTS.items():
        found = (path for pattern in patterns for path in folder.rglob(pattern))
        wanted |= {f"{place}/{path.relative_to(folder).as_posix()}" for path in found}
    told = [f"lacks {name}" for name in sorted(wanted - names)]
    own = re.compile(r"serpentail-[^/]*\.dist-info/")  # of the package, though no source
    told += [f"has {n}" for n in sorted(names - wanted) if n != PAGE and not own.match(n)]
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    told += [f"its text has a relative link: {link}" for link in links if "://" not in link]
    of_wheel = LICENCES if page else LICENCES[:1]
    return told + [f"lacks a licence: {x}" for x in of_wheel if x not in "".join(licences)]


def build(folder: Path) -> Path:
    """Return the wheel of the sdist of the checkout, both of which twine accepts."""
    shutil.rmtree(folder, ignore_errors=True)
    installer = ["--installer", "uv"] if UV else []
    own = [sys.executable, "-m"]
    subprocess.run([*own, "build", *installer, "--outdir", folder, ROOT], check=True)
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    subprocess.run([*own, "twine", "check", "--strict", wheel, sdist], check=True)
    return wheel


def interpreter(version: str) -> str | None:
    """Return a Python of a version that can make environments: of PATH, pyenv or uv."""
    candidates = [shutil.which(f"python{version}")]
    if "PYENV_ROOT" in os.environ:
        found = Path(os.environ["PYENV_ROOT"]).glob(f"versions/{version}.*/bin/python")
        candidates += map(str, sorted(found))
    if UV:
        command = [UV, "python", "find", "--no-python-downloads", version]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        candidates.append(done.stdout.strip())
    question = "import ensurepip, sys; print('%d.%d' % sys.version_info[:2])"
    for candidate in filter(None, candidates):
        done = subprocess.run([candidate, "-c", question], capture_output=True, check=False)
        if done.stdout.decode().strip() == version:
            return candidate
    return None


def tried(wheel: Path, python: str, home: Path, cache: Path) -> list[str]:
    """Install the wheel alone, use it in an empty folder, and return what failed."""
    environment, empty = home / "environment", home / "empty"
    empty.mkdir(parents=True)
    programs = environment / ("Scripts" if os.name == "nt" else "bin")
    run([python, "-m", "venv", environment], empty)
    run([programs / "python", "-m", "pip", "install", "--quiet", wheel], empty)

    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    own |= {"PATH": f"{programs}{os.pathsep}{own['PATH']}", "SERPENTAIL_CACHE": str(cache)}
    told = []
    for words in WORKS:
        done = run(words, empty, own)
        if done.returncode:
            told.append(f"{' '.join(words)}: status {done.returncode}: {done.stderr[-2000:]}")
    for extra, words in REFUSED.items():
        done = run(words, empty, own)
        if done.returncode != 2 or f'pip install "serpentail[{extra}]"' not in done.stderr:
            told.append(f"{' '.join(words)}: does not name {extra}: {done.stderr[-2000:]}")
    return told + [f"{name}: was not written" for name in MADE if not (empty / name).exists()]


def run(words: Sequence[str | Path], folder: Path, own: dict | None = None):
    """Return the finished command; without an environment of its own it must succeed."""
    told = {"capture_output": own is not None, "text": True, "timeout": 300.0}
    return subprocess.run(words, cwd=folder, env=own, check=own is None, **told)


if __name__ == "__main__":
    front.run(main, front.parser(__doc__, "output/dist").parse_args().folder)

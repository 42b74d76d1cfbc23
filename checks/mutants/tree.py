"""Makes copies of the sources in which mutants run; the checkout itself is never changed."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLACE = ROOT / ".build" / "mutants"
BASE = PLACE / "base"  # the checkout as it was when the run began
BUILT = (Path("runtime/serpentail/show/page/page.html"),)  # git ignores it, and tests need it
LONGEST_TEST = 120  # s that one test may take
JUDGED_BY = ("codegen", "runtime", "tests", "checks", "scenes", "pyproject.toml")


def sources() -> list[Path]:
    """Return all files of the checkout, from its root, that git knows or would add."""
    words = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    told = subprocess.run(words, cwd=ROOT, capture_output=True, check=True).stdout.decode()
    return sorted({Path(name) for name in told.split("\0") if name and (ROOT / name).is_file()})


def snapshot() -> None:
    """Update the base to the present checkout; files that were built in it stay."""
    BASE.mkdir(parents=True, exist_ok=True)
    for entry in BASE.iterdir():
        if entry.name != ".build":
            remove = shutil.rmtree if entry.is_dir() else Path.unlink
            remove(entry)
    for path in [*sources(), *(path for path in BUILT if (ROOT / path).is_file())]:
        (BASE / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / path, BASE / path)
    for words in (["init", "--quiet"], ["add", "--all"]):  # some tests ask git
        subprocess.run(["git", *words], cwd=BASE, check=True)


def planted(name: str) -> Path:
    """Copy the base, without built files, to a tree of this name; return its root."""
    tree = PLACE / name
    shutil.rmtree(tree, ignore_errors=True)
    return shutil.copytree(BASE, tree, ignore=shutil.ignore_patterns(".build"))


def state(tests: bool) -> str:
    """Return a name for all that decides what tests of the base run; with the tests themselves, for
    all that decides what becomes of a mutant.
    """
    known = hashlib.sha256(sys.version.encode())
    for folder in JUDGED_BY:
        for path in sorted([BASE / folder, *(BASE / folder).rglob("*")]):
            if path.is_file() and (tests or not path.name.startswith("test_")):
                known.update(f"{path.relative_to(BASE)}\0".encode() + path.read_bytes())
    return known.hexdigest()[:16]


def digest(path: str) -> str:
    """Return a name for the text of a file of the base."""
    return hashlib.sha256((BASE / path).read_bytes()).hexdigest()[:16]


def surroundings(tree: Path, scratch: Path, **more: str) -> dict[str, str]:
    """Return the environment in which a tree's own packages are found before those installed."""
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    path = os.pathsep.join(map(str, (tree, tree / "codegen", tree / "runtime")))
    own = {"PYTHONPATH": path, "TMPDIR": str(scratch), "PYTHONPYCACHEPREFIX": str(tree) + ".pyc"}
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    return kept | own | {"OMP_NUM_THREADS": "1"} | more


def pytest_with(plugin: str, scratch: Path, *words: str) -> list[str]:
    """Return the command that runs tests, with one of the plugins here."""
    settings = ["--quick", "-m", "not slow", "-n", "0", "-o", f"timeout={LONGEST_TEST}", "-q"]
    quiet = ["-p", "no:cacheprovider", "--tb=line", "--basetemp", str(scratch / "t")]
    return [sys.executable, "-m", "pytest", "-p", plugin, *settings, *quiet, *words]

"""Reads the fenced blocks of documents, and runs them in order, in one namespace and one folder.

The words behind a block's language say what it is:

- ```` ```python ````: it runs, after the blocks above it on the page.
- ```` ```c fall.c ````: its text is the file ``fall.c``, which blocks below it use.
- ```` ```sh not-run: it needs a cluster ````: nobody runs it here, for a reason.
"""

import io
import os
import re
import shutil
import subprocess
import sys
import tomllib
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from jsonschema import Draft7Validator

from serpentail.scenes.schema import scene_schema
from serpentail_codegen.scene.parse import parse_scene

ROOT = Path(__file__).parents[2]
ABOVE = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")
PAGES = {Path(name).stem: ROOT / name for name in ABOVE}
PAGES |= {
    path.relative_to(ROOT / "docs").as_posix().removesuffix(".md"): path
    for path in sorted((ROOT / "docs").rglob("*.md"))
}
DIRECTIVE = re.compile(r"\{[\w-]+\}")  # of the site: a list of pages, an included document
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NOT_RUN = "not-run:"
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror")
LINKED = ("runtime", "codegen", "scenes", "tests", "checks", "benchmarks", "docs")
LINKED += ("Makefile", "pyproject.toml", "hatch_build.py", "viewer")
# what a make that runs these tests says to every make below it, EXTRAS of CI's command among it
OF_MAKE = re.compile(r"MAKE|MFLAGS|(EXTRAS|UV|TAIL|M|N|SCENE|REAL|EMISSION|BAKED|FUNCTIONS)$")
STAMPS = (".draws", ".paged", ".ready")  # of what is installed, each after those before it
# Programs of .venv: this interpreter, and no installation, which would reach the real environment.
PROGRAM = """#!/bin/sh
case "$*" in *"pip install"*) echo "no pip in here" >&2; exit 9;; esac
exec {} "$@"
"""
OF_RUNTIME = ("simulate", "plan", "identify", "sweep", "phase")  # tables that the runtime reads


@dataclass(frozen=True)
class Block:
    """A fenced block; name: of the file that it is; reason: why it is not run."""

    page: Path
    line: int
    language: str
    text: str
    name: str
    reason: str

    def __str__(self) -> str:
        return f"{self.page.name}, line {self.line}"


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a document in order, those of the site left out."""
    document = page.read_text(encoding="utf-8")
    found = []
    for fence in FENCE.finditer(document):
        language, _, words = fence[1].partition(" ")
        if not DIRECTIVE.match(language):
            line = document.count("\n", 0, fence.start()) + 1
            name, _, reason = words.partition(NOT_RUN)
            found.append(Block(page, line, language, fence[2], name.strip(), reason.strip()))
    return found


def stand_in(tree: Path) -> None:
    """Give a folder a .venv that is ready, whose programs are those of this interpreter."""
    programs = tree / ".venv" / "bin"
    programs.mkdir(parents=True)
    for name, command in (
        ("python", sys.executable),
        ("serpentail", f"{sys.executable} -m serpentail"),
    ):
        (programs / name).write_text(PROGRAM.format(command))
        (programs / name).chmod(0o755)
    for stamp in STAMPS:
        (tree / ".venv" / stamp).touch()


def run_page(page: Path, folder: Path) -> str:
    """Run the blocks of a page in a folder like a checkout; return what they print."""
    for name in LINKED:
        (folder / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "examples", folder / "examples")  # scripts write beside themselves
    stand_in(folder)
    names: dict = {"__name__": "page"}
    printed = io.StringIO()
    own = {name: value for name, value in os.environ.items() if not OF_MAKE.match(name)}
    own["PATH"] = f"{folder}/.venv/bin:{Path(sys.executable).parent}:{os.environ['PATH']}"
    todo = [block for block in blocks(page) if not block.reason]
    with mock.patch.dict(os.environ, own, clear=True), chdir(folder), redirect_stdout(printed):
        for block in todo:
            _do(block, names)
        for block in todo:
            if block.language == "c":
                _compile(block)
    return printed.getvalue()


def _do(block: Block, names: dict) -> None:
    if block.name:
        Path(block.name).write_text(block.text, encoding="utf-8")
    if block.language == "python":
        exec(compile("\n" * block.line + block.text, str(block.page), "exec"), names)
    elif block.language == "sh":  # whose FOLDER is what Python calls ``folder``
        own = {"FOLDER": names["folder"]} if "folder" in names else {}
        _command(block, ["bash", "-euc", block.text], os.environ | own)
    elif block.language == "toml":  # parsed as the generator does, and all of it by the schema
        tables = tomllib.loads(block.text)
        parse_scene({k: v for k, v in tables.items() if k not in OF_RUNTIME}, "example")
        faults = [error.message for error in Draft7Validator(scene_schema()).iter_errors(tables)]
        assert faults == [], f"{block}: {faults}"


def _command(block: Block, command: list[str], own: dict | None = None) -> None:
    """Run a command, which must succeed, and print what it does."""
    done = subprocess.run(command, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{block}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
    print(done.stdout, end="")


def _compile(block: Block) -> None:
    """Compile a C file without warnings against the models that are there, and run it."""
    flags = [f"-I{folder}/include" for folder in Path().glob("generated/*")]
    sources = [path for path in Path().glob("generated/*/src/*.c") if path.stem == path.parts[1]]
    own = ["-lm", "-o", "checked"]
    _command(block, ["cc", *STRICT, *flags, block.name, *map(str, sources), *own])
    _command(block, ["./checked"])

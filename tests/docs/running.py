"""Runs the blocks of a document, in order, in one namespace and one folder."""

import io
import os
import shutil
import subprocess
import sys
import tomllib
from contextlib import ExitStack, chdir, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from unittest import mock

from jsonschema import Draft7Validator

from serpentail.scenes.schema import scene_schema
from serpentail_codegen.scene.parse import parse_scene
from tests.docs.blocks import ROOT, Block, blocks
from tests.support.makes import away_from_make, stand_in

STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror")
LINKED = ("runtime", "codegen", "scenes", "tests", "embedded", "benchmarks", "docs", "stress")
LINKED += ("Makefile", "pyproject.toml", "hatch_build.py", "viewer", "mutants")
OF_RUNTIME = ("simulate", "plan", "identify", "sweep", "phase")  # tables that the runtime reads


@dataclass(frozen=True)
class Ran:
    """What a page left: the names of its Python blocks, what they printed, and the folder."""

    names: dict
    printed: str
    folder: Path


def run_page(page: Path, folder: Path) -> Ran:
    """Run the blocks of a page in a folder like a checkout; raise what fails."""
    like_a_checkout(folder)
    names: dict = {"__name__": "page"}
    printed = io.StringIO()
    own = away_from_make()
    own["PATH"] = f"{folder}/.venv/bin:{Path(sys.executable).parent}:{os.environ['PATH']}"
    todo = [block for block in blocks(page) if not block.reason]
    with ExitStack() as stack:
        stack.enter_context(mock.patch.dict(os.environ, own, clear=True))
        stack.enter_context(chdir(folder))
        stack.enter_context(redirect_stdout(printed))
        for block in todo:
            _do(block, names)
        for block in todo:
            if block.language == "c":
                _compile(block)
    return Ran(names, printed.getvalue(), folder)


def like_a_checkout(folder: Path) -> None:
    """Fill a folder with what commands of a checkout use; results stay in it."""
    for name in LINKED:
        (folder / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "examples", folder / "examples")  # scripts write beside themselves
    stand_in(folder)


def _do(block: Block, names: dict) -> None:
    """Do what a block says."""
    if block.name:
        Path(block.name).write_text(block.text, encoding="utf-8")
    if block.language == "python":
        exec(compile("\n" * block.line + block.text, str(block.page), "exec"), names)
    elif block.language == "sh":
        _shell(block, names)
    elif block.language == "toml":
        _scene(block)


def _shell(block: Block, names: dict) -> None:
    """Run commands; FOLDER of the shell is what Python calls ``folder``."""
    own = {"FOLDER": names["folder"]} if "folder" in names else {}
    done = subprocess.run(
        ["bash", "-euc", block.text],
        env=os.environ | own,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{block}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
    print(done.stdout, end="")


def _scene(block: Block) -> None:
    """Parse a scene as the generator does, and compare all of it with the schema."""
    tables = tomllib.loads(block.text)
    parse_scene({k: v for k, v in tables.items() if k not in OF_RUNTIME}, "example")
    faults = [error.message for error in schema().iter_errors(tables)]
    assert faults == [], f"{block}: {faults}"


@cache
def schema() -> Draft7Validator:
    """Return what checks a scene with all its tables, as editors do."""
    return Draft7Validator(scene_schema())


def _compile(block: Block) -> None:
    """Compile a C file without warnings against the models that are there; run it if it can."""
    folders = list(Path("generated").glob("*/manifest.json"))
    flags = [f"-I{manifest.parent}/include" for manifest in folders]
    sources = [str(path) for path in Path("generated").glob("*/src/*.c")] if folders else []
    sources = [path for path in sources if Path(path).stem == Path(path).parents[1].name]
    command = ["cc", *STRICT, *flags, block.name, *sources, "-lm", "-o", "checked"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{block}: {done.stderr}"
    done = subprocess.run(["./checked"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{block}: {done.stderr}"
    print(done.stdout, end="")

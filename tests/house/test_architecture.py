"""The house rules that a machine can check: who imports what, how large things are, what has a
docstring.
"""

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import serpentail
import serpentail_codegen
from tests.house import file_lengths

CODEGEN, RUNTIME = (Path(package.__file__).parent for package in (serpentail_codegen, serpentail))
ROOT = Path(__file__).parents[2]
SOURCES = sorted(path for package in (CODEGEN, RUNTIME) for path in package.rglob("*.py"))
TEMPLATES = sorted(CODEGEN.rglob("*.jinja"))
WITHOUT_SYMPY = (
    "ir.tape",
    "ir.interpret",
    "autodiff.reverse",
    "passes.schedule",
    "scene.parse",
    "targets.write",
    "targets.templating",
    "targets.expressions",
    "targets.c.routine",
)
every_source = pytest.mark.parametrize(
    "path", SOURCES, ids=lambda path: f"{path.parent.name}/{path.name}"
)


def python(script):
    """Run a script in a process of its own, the two packages at hand; return its output."""
    preamble = f"import sys; sys.path[:0] = [{str(CODEGEN.parent)!r}, {str(RUNTIME.parent)!r}]\n"
    done = subprocess.run(
        [sys.executable, "-c", preamble + script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.strip()


def tool(name):
    """The path of a development tool beside the interpreter, or on PATH."""
    beside = Path(sys.executable).parent / name
    found = str(beside) if beside.exists() else shutil.which(name)
    assert found, f"{name} is not installed: make setup"
    return found


@pytest.fixture(scope="module")
def settings():
    """The tools' settings in pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]


# Imports.


def test_import_contracts_hold():
    done = subprocess.run(
        [tool("lint-imports"), "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"Contracts: [4-9] kept, 0 broken", done.stdout)


def imported(path):
    """Names of the top-level packages that a module imports anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.split(".")[0]


def test_only_the_mechanics_import_sympy():
    assert {path.parent for path in SOURCES if "sympy" in imported(path)} == {CODEGEN / "mechanics"}


def test_only_templating_imports_jinja2():
    assert {path.stem for path in SOURCES if "jinja2" in imported(path)} == {"templating"}


@pytest.mark.parametrize("module", WITHOUT_SYMPY)
def test_tape_programs_and_printers_work_without_sympy(module):
    assert (
        python(f"sys.modules['sympy'] = None; import serpentail_codegen.{module}; print('here')")
        == "here"
    )


def test_derivation_needs_sympy():
    """The control of the test above: a blocked module cannot be imported."""
    script = (
        "sys.modules['sympy'] = None\ntry:\n    import serpentail_codegen.mechanics.lower\nexcept "
        "ImportError as e:\n    print(e)"
    )
    assert "sympy" in python(script)


@pytest.mark.parametrize(
    "module", ["serpentail_codegen.scene.parse", "serpentail_codegen.__main__"]
)
def test_reading_a_scene_is_light(module):
    heavy = "{'sympy', 'jinja2', 'casadi', 'numpy', 'scipy', 'mpmath'}"
    assert python(f"import {module}; print(sorted({heavy} & set(sys.modules)))") == "[]"


def test_importing_the_runtime_is_light():
    heavy = "{'sympy', 'jinja2', 'casadi', 'numpy', 'scipy', 'matplotlib', 'serpentail_codegen'}"
    assert python(f"import serpentail; print(sorted({heavy} & set(sys.modules)))") == "[]"


def test_packages_have_one_version():
    assert serpentail.__version__ == serpentail_codegen.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", serpentail.__version__)


# Sizes.


def test_files_are_short_and_a_longer_one_is_refused(tmp_path):
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "long.py").write_text("x = 1\n" * (file_lengths.MOST_LINES + 1))
    (tmp_path / "room" / "short.py").write_text("x = 1\n" * file_lengths.MOST_LINES)
    (complaint,) = file_lengths.too_long(tmp_path)
    assert "long.py: 301 lines" in complaint
    assert file_lengths.main() == 0


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.name)
def test_templates_are_short_and_print_no_numbers_of_their_own(path):
    lines = path.read_text().splitlines()
    assert len(lines) <= 120
    assert not [line for line in lines if re.search(r"%\.\d+[feg]", line) and "printf" not in line]


LONG = '"""Sample."""\n\n\ndef long():\n    """Do too much."""\n' + "".join(
    f"    x{k} = {k}\n" for k in range(41)
)
TANGLED = '"""Sample."""\n\n\ndef tangled(x):\n    """Branch too much."""\n' + "".join(
    f"    if x == {k}:\n        x = {k + 1}\n" for k in range(11)
)
CROWDED = '"""Sample."""\n\n\ndef crowded(a, b, c, d, e, f, g):\n    """Take too much."""\n'
SILENT = '"""Sample."""\n\n\ndef silent():\n    return 1\n'


@pytest.mark.parametrize("package", ["codegen/serpentail_codegen", "runtime/serpentail"])
@pytest.mark.parametrize(
    ("text", "rule"),
    [(LONG, "PLR0915"), (TANGLED, "C901"), (CROWDED, "PLR0913"), (SILENT, "D103")],
    ids=["long", "tangled", "crowded", "silent"],
)
def test_linter_refuses_what_the_rules_refuse(package, text, rule):
    command = [
        tool("ruff"),
        "check",
        "--no-cache",
        "--output-format=concise",
        "--stdin-filename",
        f"{package}/sample.py",
    ]
    done = subprocess.run(
        [*command, "-"], cwd=ROOT, input=text, capture_output=True, text=True, check=False
    )
    assert rule in done.stdout


def test_linter_limits_are_those_of_the_house(settings):
    lint = settings["ruff"]["lint"]
    assert lint["pylint"]["max-statements"] <= 40 and lint["pylint"]["max-args"] <= 6
    assert lint["mccabe"]["max-complexity"] <= 10
    exempt = {rule for rules in lint.get("per-file-ignores", {}).values() for rule in rules} | set(
        lint["ignore"]
    )
    assert not exempt & {"PLR0915", "C901", "D100", "D101", "D102", "D103", "D104"}


def test_warnings_are_errors(settings):
    options = settings["pytest"]["ini_options"]
    assert options["filterwarnings"][0] == "error" and options["xfail_strict"] is True
    assert "--strict-markers" in options["addopts"] and "--strict-config" in options["addopts"]


# Words.


def public(tree):
    """Public functions and classes of a module, and public methods of its public classes."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    for node in tree.body:
        if isinstance(node, kinds) and not node.name.startswith("_"):
            yield node
            for item in node.body if isinstance(node, ast.ClassDef) else ():
                named = isinstance(item, kinds) and not item.name.startswith("_")
                if named and "overload" not in map(ast.unparse, item.decorator_list):
                    yield item


def a_sentence(docstring):
    """The first paragraph of a docstring is one sentence or more."""
    return bool(docstring) and docstring.partition("\n\n")[0].rstrip().endswith((".", ":"))


@every_source
def test_public_names_have_docstrings(path):
    tree = ast.parse(path.read_text())
    assert a_sentence(ast.get_docstring(tree))
    assert [node.name for node in public(tree) if not a_sentence(ast.get_docstring(node))] == []

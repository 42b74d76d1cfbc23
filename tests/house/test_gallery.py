"""Examples of the gallery: short, of public names alone, they run anywhere and draw a figure."""

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import serpentail as st

FOLDER = Path(__file__).parents[2] / "examples" / "gallery"
SCRIPTS = sorted(FOLDER.glob("plot_*.py"))
MOST = 60  # lines must be fewer: all that are not blank, of code, text and comments together
WIDEST = 7.0  # in, of a figure: 700 px on the page
FREE = {"matplotlib.pyplot", "numpy", "pathlib", "serpentail", "subprocess", "tempfile"}
EXTRAS = {"casadi": "plan", "jax": "jax", "jax.numpy": "jax"}
OF_NAMES = {"plan": "plan", "Mpc": "plan", "environments": "gym", "jax_functions": "jax"}
STILL = {"plot_14_board", "plot_15_learning"}  # nothing that moves is shown
QUICK = {"plot_08_robot", "plot_09_elastic_tail", "plot_12_sweep"}  # others: over 5 s from nothing

# What scripts print where their story is true.
SAID = {
    "plot_03_sequence": "landed on its feet: True",
    "plot_04_plan": "links: success",
    "plot_05_objectives": r"(found True.*\s+.*){3}",
    "plot_06_mpc": r"(?s)PFL: tilted by \d\d.* deg.*MPC: tilted by [01]\.\d deg",
    "plot_07_gecko": "links: success",
    "plot_12_sweep": "121 of 121 points done, 0 of them failed",
    "plot_13_casadi_mpc": r"68\.8 deg at the start, 0\.\d+ deg at the end",
    "plot_17_jax": r"tilt 45\.8, then \d\.\d deg",
    "plot_18_tail_length": r"found True: 157 mm\s+found True: 1[56]\d mm",
}

# Runs a script as the site does: the value of the last expression is what the page shows.
DRIVER = """
import ast, json, pathlib, sys
import matplotlib.pyplot as plt
plt.show = lambda: None
path = sys.argv[1]
tree = ast.parse(pathlib.Path(path).read_text(encoding="utf-8"))
last = tree.body.pop()
names = {"__name__": "__main__", "__file__": path}
exec(compile(tree, path, "exec"), names)
shown = ""
if isinstance(last, ast.Expr):
    value = eval(compile(ast.Expression(last.value), path, "eval"), names)
    shown = value._repr_html_() if hasattr(value, "_repr_html_") else ""
figures = [plt.figure(number) for number in plt.get_fignums()]
for figure in figures:
    figure.canvas.draw()
axes = [[ax.get_title() or ax.get_label(), ax.get_xlabel(), ax.get_ylabel()]
        for figure in figures for ax in figure.axes]
width = max((figure.get_size_inches()[0] for figure in figures), default=0)
print(json.dumps({"figures": len(figures), "axes": axes, "width": width, "shown": shown}))
"""


def text_of(script: Path) -> str:
    return script.read_text(encoding="utf-8")


def faults(text: str) -> list[str]:
    """What is wrong with a script, without running it."""
    tree = ast.parse(text)
    told = ast.get_docstring(tree) or ""
    title, underline, *rest = [*told.splitlines(), "", ""]
    found = []
    if not title or set(underline) != {"="} or len(underline) < len(title) or not any(rest):
        found.append("no title")
    if sum(bool(line.strip()) for line in text.splitlines()) >= MOST:
        found.append("too long")
    modules, names = imported(tree), public(tree)
    found += [f"imports {name}" for name in sorted(modules - FREE - EXTRAS.keys())]
    found += [f"st.{name} is not public" for name in sorted(names - set(st.__all__))]
    found += [f"private {n.attr}" for n in ast.walk(tree) if is_private(n)]
    needed = {EXTRAS[name] for name in modules & EXTRAS.keys()}
    needed |= {OF_NAMES[name] for name in names & OF_NAMES.keys()}
    said = " ".join(told.split())
    found += [f"no word of {x}" for x in sorted(needed) if f'"serpentail[{x}]"' not in said]
    return found


def imported(tree: ast.Module) -> set[str]:
    """Modules that are imported; of `from pathlib import Path` pathlib."""
    nodes = list(ast.walk(tree))
    names = {alias.name for n in nodes if isinstance(n, ast.Import) for alias in n.names}
    return names | {n.module or "." for n in nodes if isinstance(n, ast.ImportFrom)}


def public(tree: ast.Module) -> set[str]:
    """Names that a script takes from serpentail."""
    found = [n for n in ast.walk(tree) if isinstance(n, ast.Attribute)]
    return {n.attr for n in found if isinstance(n.value, ast.Name) and n.value.id == "st"}


def is_private(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and node.attr.startswith("_")


def test_there_are_a_dozen_or_more():
    assert len(SCRIPTS) >= 12
    assert {path.stem for path in SCRIPTS} >= STILL | QUICK | SAID.keys()
    assert [path for path in FOLDER.glob("*.py") if path not in SCRIPTS] == []
    header = (FOLDER / "GALLERY_HEADER.rst").read_text(encoding="utf-8").splitlines()
    assert header[0] == "Gallery" and header[1] == "=" * len(header[0])


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_is_short_and_of_public_names(script):
    assert faults(text_of(script)) == []


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ('"""Title\n=====\n\nText."""\n', None),
        ('"""Title\n===\n\nText."""\n', "no title"),
        ('"""Title\n=====\n"""\n', "no title"),
        ("x = 1\n", "no title"),
        ('"""Title\n=====\n\nText."""\n' + 57 * "x = 1\n\n", "too long"),
        ('"""Title\n=====\n\nText."""\nfrom serpentail.attitude import product\n', "imports"),
        ('"""Title\n=====\n\nText."""\nst.product(1)\n', "st.product is not public"),
        ('"""Title\n=====\n\nText."""\nmodel._library\n', "private _library"),
        ('"""Title\n=====\n\nText."""\nst.plan()\n', "no word of plan"),
    ],
)
def test_faults_of_a_script_are_found(words, fault):
    found = faults(words)
    assert found == [] if fault is None else len(found) == 1 and found[0].startswith(fault)


def run(script: Path, folder: Path) -> dict:
    """Run a script in a fresh process and an empty folder; return what it drew and shows."""
    place, temporary = folder / "here", folder / "temporary"
    place.mkdir()
    temporary.mkdir()
    own = {"MPLBACKEND": "agg", "TMPDIR": str(temporary)}
    done = subprocess.run(
        [sys.executable, "-P", "-c", DRIVER, str(script)],
        cwd=place,
        env=os.environ | own,
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert list(place.iterdir()) == []
    *printed, told = done.stdout.splitlines()
    return json.loads(told) | {"printed": "\n".join(printed)}


def marked(script: Path):
    marks = [] if script.stem in QUICK else [pytest.mark.slow]
    return pytest.param(script, id=script.stem, marks=marks)


@pytest.mark.parametrize("script", [marked(path) for path in SCRIPTS])
def test_a_script_runs_anywhere_and_draws(script, tmp_path):
    told = run(script, tmp_path)
    assert told["figures"] >= 1 and told["width"] <= WIDEST
    assert any(title for title, _, _ in told["axes"])
    assert all(across or up for _, across, up in told["axes"])
    assert re.search(SAID.get(script.stem, ""), told["printed"])
    moving = "<iframe" in told["shown"]
    assert moving == (script.stem not in STILL), told["shown"][:300]
    assert "Without the page" not in told["shown"]


@pytest.mark.parametrize(
    ("code", "complaint"),
    [
        ("import warnings\nwarnings.warn('odd')\n", "odd"),
        ("raise ValueError('wrong')\n", "wrong"),
        ("open('left.txt', 'w').close()\n", "left.txt"),
    ],
)
def test_a_script_that_complains_or_leaves_files_fails(code, complaint, tmp_path):
    script = tmp_path / "plot_bad.py"
    script.write_text(code + "x = 1\n")
    with pytest.raises(AssertionError, match=complaint):
        run(script, tmp_path)

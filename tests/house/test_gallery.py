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
from tests.support.rows import row

FOLDER = Path(__file__).parents[2] / "examples" / "gallery"
SCRIPTS = {path.stem: path for path in sorted(FOLDER.glob("plot_*.py"))}
MOST = 60  # lines must be fewer: all that are not blank, of code, text and comments together
WIDEST = 7.0  # in, of a figure: 700 px on the page
FREE = {"matplotlib.pyplot", "numpy", "pathlib", "serpentail", "subprocess", "tempfile"}
EXTRAS = {"casadi": "plan", "jax": "jax", "jax.numpy": "jax"}
OF_NAMES = {"plan": "plan", "Mpc": "plan", "environments": "gym", "jax_functions": "jax"}
# What scripts print where their story is true: `make docs` runs all, and looks at no numbers.
SAID = {
    "plot_03_sequence": "landed on its feet: True",
    "plot_06_mpc": r"(?s)PFL: tilted by \d\d.* deg.*MPC: tilted by [01]\.\d deg",
    "plot_12_sweep": "121 of 121 points done, 0 of them failed",
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
    nodes = list(ast.walk(tree))
    modules = {alias.name for n in nodes if isinstance(n, ast.Import) for alias in n.names}
    modules |= {n.module or "." for n in nodes if isinstance(n, ast.ImportFrom)}
    attributes = [n for n in nodes if isinstance(n, ast.Attribute)]
    names = {n.attr for n in attributes if isinstance(n.value, ast.Name) and n.value.id == "st"}
    found += [f"imports {name}" for name in sorted(modules - FREE - EXTRAS.keys())]
    found += [f"st.{name} is not public" for name in sorted(names - set(st.__all__))]
    found += [f"private {n.attr}" for n in attributes if n.attr.startswith("_")]
    needed = {EXTRAS[name] for name in modules & EXTRAS.keys()}
    needed |= {OF_NAMES[name] for name in names & OF_NAMES.keys()}
    said = " ".join(told.split())
    found += [f"no word of {x}" for x in sorted(needed) if f'"serpentail[{x}]"' not in said]
    return found


def test_scripts_are_short_and_of_public_names():
    assert len(SCRIPTS) >= 12 and SCRIPTS.keys() >= SAID.keys()
    assert {*FOLDER.glob("*.py")} == {*SCRIPTS.values()}
    for name, path in SCRIPTS.items():
        with row(name):
            assert faults(path.read_text(encoding="utf-8")) == []


def run(script: Path, folder: Path) -> dict:
    """Run a script in a fresh process and an empty folder; return what it drew and shows."""
    place, temporary = folder / "here", folder / "temporary"
    place.mkdir(parents=True)
    temporary.mkdir()
    done = subprocess.run(
        [sys.executable, "-P", "-c", DRIVER, str(script)],
        cwd=place,
        env=os.environ | {"MPLBACKEND": "agg", "TMPDIR": str(temporary)},
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert list(place.iterdir()) == []
    *printed, told = done.stdout.splitlines()
    return json.loads(told) | {"printed": "\n".join(printed)}


@pytest.mark.slow
@pytest.mark.parametrize("name", SAID)
def test_a_script_runs_anywhere_and_draws(name, tmp_path):
    told = run(SCRIPTS[name], tmp_path)
    assert told["figures"] >= 1 and told["width"] <= WIDEST
    assert any(title for title, _, _ in told["axes"])
    assert all(across or up for _, across, up in told["axes"])
    assert re.search(SAID[name], told["printed"])
    assert "<iframe" in told["shown"] and "Without the page" not in told["shown"]

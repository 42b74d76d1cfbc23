"""Every block of every document runs as pasted, or says why it does not."""

import ast
import re
import tomllib

import numpy as np
import pytest

from serpentail_codegen.scene.problems import SceneError
from tests.docs.blocks import PAGES, RUN, SHOWN, blocks
from tests.docs.running import run_page

SLOW = {"autodiff", "c", "getting_started", "identification", "learning", "models", "scenes"}
SLOW |= {"sequences", "simulation", "viewing"}
ELSEWHERE = {"README": "test_readme.py", "recipes": "tests/exporting/test_recipes.py"}
RUNNING = [
    pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else [])
    for name, path in PAGES.items()
    if name not in ELSEWHERE and any(b.language in RUN and not b.reason for b in blocks(path))
]


@pytest.mark.parametrize("name", PAGES)
def test_every_block_says_what_it_is(name):
    for block in blocks(PAGES[name]):
        assert block.language in (*RUN, *SHOWN) or block.reason, f"{block}: {block.language!r}"
        assert block.language not in ("c", "cpp") or block.name or block.reason, f"{block}: a file?"


@pytest.mark.parametrize("name", PAGES)
def test_a_block_that_is_not_run_is_sound_and_has_a_reason(name):
    for block in (each for each in blocks(PAGES[name]) if each.reason):
        assert len(block.reason.split()) > 2, block
        if block.language == "python":
            ast.parse(block.text)
        elif block.language == "toml":
            tomllib.loads(block.text)


@pytest.mark.parametrize("name", RUNNING)
def test_the_blocks_of_a_page_run(name, tmp_path):
    ran = run_page(PAGES[name], tmp_path)
    if name in TOLD:
        TOLD[name](ran)


def of_c(ran):
    """The line of the C program is the model's own acceleration."""
    import serpentail as st

    model = st.load(ran.folder / "generated" / "articulated_m3_n4")
    q = np.array([0, 0, 0, 1, 0, 0, 0, 0.5, 0, 0, 0, 0, 0])
    v_dot = model.forward_dynamics(q, np.zeros(model.nv), np.array([1e-3, 0, 0, 0, 0, 0]))
    line = f"status 0, p_ddot_z = {v_dot[2]:g} m/s^2, alpha_1_ddot = {v_dot[6]:g} rad/s^2\n"
    assert ran.printed.count(line) == 2  # by the page's command, and without warnings


def of_planning(ran):
    """The plan is true."""
    good, error, _ = ran.printed.split()[:3]
    assert good == "True" and float(error) <= 0.01


def of_sweeps(ran):
    """The study is complete, as the page says."""
    text = PAGES["sweeps"].read_text(encoding="utf-8")
    first, second = ran.printed.splitlines()
    assert first == re.search(r"print\(study.status\(\)\)  # (.*)", text)[1] and float(second) > 0
    assert {path.name for path in ran.folder.iterdir()} >= {"study.db", "run.html"}


def of_getting_started(ran):
    """The planned flight ends upright, and the passive one does not."""
    tilts = re.findall(r"^(\S+) degrees of tilt at the end", ran.printed, re.MULTILINE)
    planned, passive = map(float, tilts[-2:])
    assert planned < 0.1 and passive > 90


def of_casadi(ran):
    """The examples find their postures and the motion."""
    assert ran.printed.count("Solve_Succeeded") == 3


def of_python(ran):
    """The equation of motion holds."""
    numbers = re.search(r"C = \[(.*?)\]", ran.printed, re.DOTALL)[1].split()
    assert np.abs(np.array(numbers, float)).max() < 1e-12


TOLD = {
    "c": of_c,
    "casadi": of_casadi,
    "getting_started": of_getting_started,
    "planning": of_planning,
    "python": of_python,
    "sweeps": of_sweeps,
}


# The runner.


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("```python\na = 1\n```\n```python\nassert a == 2\n```", AssertionError),
        ("```python\nimport warnings\nwarnings.warn('slow')\n```", UserWarning),
        ("```sh\nfalse\ntrue\n```", AssertionError),
        ("```sh\n.venv/bin/python -m pip install nothing\n```", AssertionError),
        ("```toml\nkind = 'articulated'\nsegments = 0\nlinks = 3\n```", SceneError),
        (
            "```toml\nkind = 'continuum'\nsegments = 1\n[simulate]\ndurations = 1\n```",
            AssertionError,
        ),
        ("```c x.c\nint main(void) { int unused; return 0; }\n```", AssertionError),
        ("```c x.c\nint main(void) { return 1; }\n```", AssertionError),
    ],
)
def test_what_is_wrong_in_a_block_is_found(text, fault, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(text + "\n")
    with pytest.raises(fault):
        run_page(page, tmp_path)


def test_blocks_of_a_page_share_names_files_and_folder(tmp_path):
    page = tmp_path / "page.md"
    parts = [
        "```text\nnot code\n```",
        "```python\nnumber = 2\n```",
        '```c x.c\n#include <stdio.h>\nint main(void) { puts("three"); return 0; }\n```',
        "```sh\ncc x.c -o x && ./x > said\n```",
        "```python\nfrom pathlib import Path\nprint(number, Path('said').read_text().strip())\n```",
        "```sh not-run: it would fail\nfalse\n```",
    ]
    page.write_text("\n".join(parts) + "\n")
    ran = run_page(page, tmp_path)
    assert (ran.printed, ran.names["number"]) == ("2 three\nthree\n", 2)

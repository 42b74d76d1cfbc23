"""Studies and examples: their models and figures, parts that are made once, and the gallery."""

import ast
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

import serpentail as st
from examples import learning
from examples.studies import morphology_study as study
from examples.studies.parts import Part, as_flight, as_lists, digest, made
from tests.support import tiny_study, zoo
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
PATIENCE = 60  # s


def test_links_of_a_cone_are_those_of_its_integrals():
    length, mass, taper = 0.15, 0.004, 0.1
    links = study.cone(length, mass, taper)
    base = np.sqrt(mass / (study.DENSITY * np.pi * length * (1 + taper + taper**2) / 3))
    for k in range(study.LINKS):
        ends = k * length / study.LINKS, (k + 1) * length / study.LINKS

        def whole(f, ends=ends):
            """The integral over the link of f(s, r^2) for each area."""

            def at(s):
                squared = (base * (1 - (1 - taper) * s / length)) ** 2
                return study.DENSITY * np.pi * squared * f(s, squared)

            return quad(at, *ends, epsabs=0, epsrel=1e-12)[0]

        own = whole(lambda s, _: 1)
        center = whole(lambda s, _: s) / own
        # of a disc of radius r about its axis r^2 / 2, about a diameter r^2 / 4, for each kilogram
        axial = whole(lambda _, squared: squared / 2)
        across = whole(lambda s, squared, c=center: squared / 4 + (s - c) ** 2)
        assert links["link_masses"][k] == pytest.approx(own, rel=1e-10)
        assert links["link_centers"][k] == pytest.approx(center - ends[0], rel=1e-8)
        found = links["link_inertias"][3 * k : 3 * k + 3]
        np.testing.assert_allclose(found, [across, axial, across], rtol=1e-9)


def test_a_study_starts_with_its_attitude_and_rates():
    model_point = {"yaw": 0.1, "pitch": 2.0, "roll": -0.2, "pitch_rate": 12.0}
    q, v = study.start(zoo.model("m2_n2"), model_point | {"other_rates": [1.0, -2.0]})
    turns = ([0, 0, 0.1], [2.0, 0, 0], [0, -0.2, 0])  # R = Rz(yaw) Rx(pitch) Ry(roll)
    z, x, y = (Rotation.from_rotvec(turn).as_matrix() for turn in turns)
    np.testing.assert_allclose(st.rotation_matrix(q[3:7]), z @ x @ y, atol=1e-12)
    np.testing.assert_array_equal(v[3:6], [12.0, 1.0, -2.0])


@pytest.mark.slow
def test_a_policy_learns_to_right_the_rat():
    worlds = st.environments(zoo.model("m1_n3"), "righting", 512, step=2e-3, substeps=3)
    _, tilts = learning.learn(worlds, rounds=60)
    assert np.mean(tilts[:10]) > 35 and np.mean(tilts[-10:]) < 0.8 * np.mean(tilts[:10])


# Parts of studies.


def one(folder, of, make, files=()):
    """The result of a part called "one"."""
    return made("study", folder, {"one": Part(make, of, files)})["one"]


def ended(folder):
    """How often each part ended."""
    path = folder / "ended"
    lines = path.read_text().splitlines() if path.exists() else []
    return Counter(int(line.split()[0]) for line in lines)


def test_parts_are_made_once_and_again_where_inputs_change_or_files_are_gone(tmp_path):
    make, picture = partial(tiny_study.square, 3, tmp_path), tmp_path / "picture.png"
    for starts, gone, count in [(2, False, 1), (2, False, 1), (3, False, 2), (3, True, 3)]:
        if gone:
            picture.unlink()
        found = one(tmp_path / "parts", {"starts": (1, starts)}, make, (picture,))
        assert found == {"number": 3, "square": 9, "third": 1.0} and ended(tmp_path) == {3: count}
        picture.touch()
    flight = st.simulate(zoo.model("m1_n1"), [0, 0, 0, 1, 0, 0, 0, 0, 0], np.ones(8), t_span=0.01)
    again = as_flight(as_lists(flight))
    for name in as_lists(flight):
        np.testing.assert_array_equal(getattr(again, name), getattr(flight, name))


def test_a_part_that_fails_is_told_and_none_is_made_while_another_process_writes(tmp_path):
    with pytest.raises(st.SerpentailError, match="one: ZeroDivisionError: no such part"):
        one(tmp_path, {}, tiny_study.wrong)
    assert tiny_study.titles(tmp_path / "study.db") == []
    lock = FileLock(tmp_path / ".study.db.lock")
    with lock, pytest.raises(st.SerpentailError, match="another process is writing"):
        one(tmp_path, {}, tiny_study.ones)
    assert np.isnan(one(tmp_path, {}, tiny_study.lost)["lost"])  # JSON has no NaN of its own


def started(folder, threads="3", **settings):
    """Start the tiny study in processes."""
    folder.mkdir(exist_ok=True)
    return subprocess.Popen(
        [sys.executable, "-m", "tests.support.tiny_study", str(folder)],
        cwd=ROOT,
        env=os.environ | {"SERPENTAIL_THREADS": threads},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **settings,
    )


def test_a_study_that_is_killed_goes_on_side_by_side_and_makes_no_part_twice(tmp_path):
    folder = tmp_path / "many"
    store, process = folder / "parts" / "tiny.db", started(folder)
    while len(tiny_study.titles(store)) < 3:
        time.sleep(0.02)
    process.kill()
    process.communicate(timeout=PATIENCE)  # ends when the workers have, which hold its pipes
    counts = ended(folder)
    kept = {k: counts[k] for k in (int(title.split()[1]) for title in tiny_study.titles(store))}
    process = started(folder)
    printed, errors = process.communicate(timeout=PATIENCE)
    parts = range(tiny_study.PARTS)
    results = [(f"part {k}", {"number": k, "square": k**2, "third": k / 3}) for k in parts]
    assert printed == f"{results}\n", errors
    counts = ended(folder)
    assert {k: counts[k] for k in kept} == kept and len(counts) == tiny_study.PARTS
    assert f" {process.pid}\n" not in (folder / "ended").read_text()  # it is for workers


@pytest.mark.parametrize("whole", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_ctrl_c_ends_all_in_one_line(tmp_path, whole):
    """From a terminal all processes hear it, from another program the parent alone."""
    folder = tmp_path / "many"
    process = started(folder, "1", start_new_session=True)  # one that has begun, when parts end
    while not tiny_study.titles(folder / "parts" / "tiny.db"):
        time.sleep(0.02)
    (os.killpg if whole else os.kill)(process.pid, signal.SIGINT)
    printed, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and printed == ""
    *told, last = errors.splitlines()
    assert last == "interrupted: the same command goes on from here"
    assert [line for line in told if not line.startswith("sweep")] == []


def test_digests_follow_the_sources(tmp_path):
    found = []
    for name, text in [("a.py", "1"), ("notes.md", "words"), ("a.py", "2"), ("native.c", "int x;")]:
        (tmp_path / name).write_text(text)
        found.append(digest(tmp_path))
    assert found[0] == found[1] and len(set(found)) == 3


# The gallery.

SCRIPTS = {path.stem: path for path in sorted((ROOT / "examples/gallery").glob("*.py"))}
MOST = 60  # lines must be fewer: all that are not blank, of code, text and comments together
FREE = {"matplotlib.pyplot", "numpy", "pathlib", "serpentail", "subprocess", "tempfile"}
EXTRAS = {"casadi": "plan", "jax": "jax", "jax.numpy": "jax"}
OF_NAMES = {"plan": "plan", "Mpc": "plan", "environments": "gym", "jax_functions": "jax"}
# What scripts print where their story is true: `make docs` runs all, and looks at no numbers.
SAID = {
    "plot_03_sequence": "landed on its feet: True",
    "plot_06_mpc": r"(?s)PFL: tilted by \d\d.* deg.*MPC: tilted by [01]\.\d deg",
    "plot_12_sweep": "121 of 121 points done, 0 of them failed",
}


def test_scripts_of_the_gallery_are_short_of_public_names_and_tell_their_extras():
    assert len(SCRIPTS) >= 12
    for name, path in SCRIPTS.items():
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        nodes = list(ast.walk(tree))
        modules = {alias.name for n in nodes if isinstance(n, ast.Import) for alias in n.names}
        modules |= {n.module or "." for n in nodes if isinstance(n, ast.ImportFrom)}
        attributes = [n for n in nodes if isinstance(n, ast.Attribute)]
        names = {n.attr for n in attributes if isinstance(n.value, ast.Name) and n.value.id == "st"}
        needed = {EXTRAS[name] for name in modules & EXTRAS.keys()}
        needed |= {OF_NAMES[name] for name in names & OF_NAMES.keys()}
        told = " ".join(ast.get_docstring(tree).split())
        with row(name):
            assert sum(bool(line.strip()) for line in text.splitlines()) < MOST
            assert modules <= FREE | EXTRAS.keys() and names <= {*st.__all__}
            assert not [n.attr for n in attributes if n.attr.startswith("_")]
            assert [x for x in needed if f'"serpentail[{x}]"' not in told] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", SAID)
def test_a_script_of_the_gallery_runs_anywhere_and_is_true(name, tmp_path):
    (tmp_path / "here").mkdir()
    own = os.environ | {"MPLBACKEND": "agg", "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-P", "-W", "ignore:FigureCanvasAgg", SCRIPTS[name]]
    done = subprocess.run(
        command, cwd=tmp_path / "here", env=own, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "") and re.search(SAID[name], done.stdout)
    assert list((tmp_path / "here").iterdir()) == []

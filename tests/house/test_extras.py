"""What needs a library of an extra names the extra before it works; all else does without."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

import serpentail as st
from serpentail import cli
from serpentail.building import build as building
from serpentail.scenes.plan import planned
from serpentail.verification import report
from tests.support import zoo
from tests.support.drawn_flight import flight
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
RUNTIME = ROOT / "runtime" / "serpentail"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
BROUGHT_ALONG = {"trimesh": "viser"}  # by a library of the extra
GATE = re.compile(r'\bneeded\("(\w+)", "(\w+)"\)')
HOMES = {  # where alone a library of an extra may be imported, behind the room's gates
    "casadi": ("model/casadi.py", "model/nodes/", "planning/"),
    "matplotlib": ("pictures/",),
    "PIL": ("pictures/",),
    "imageio_ffmpeg": ("pictures/encode.py",),
    "ezc3d": ("identification/readers.py",),
    "gymnasium": ("learning/environments.py",),
    "jax": ("differentiable/jax_calls.py", "differentiable/jax_functions.py"),
    "torch": ("differentiable/torch_functions.py",),
}


@pytest.fixture
def without(monkeypatch):
    """Return a function after which a library cannot be imported."""
    return lambda name: monkeypatch.setitem(sys.modules, name, None)


def missing(extra):
    return pytest.raises(st.ExtraMissing, match=rf'pip install "serpentail\[{extra}\]"')


def names(requirements):
    return {re.match(r"[\w-]+", text)[0] for text in requirements}


def test_every_gate_names_an_extra_that_brings_the_library():
    texts = [path.read_text(encoding="utf-8") for path in RUNTIME.rglob("*.py")]
    gates = {gate for text in texts for gate in GATE.findall(text)}
    assert len(gates) >= 7
    for module, extra in gates:
        assert BROUGHT_ALONG.get(module, module) in names(EXTRAS[extra])


def test_libraries_of_extras_are_imported_in_their_rooms_alone():
    for path in RUNTIME.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for library, homes in HOMES.items():
            if re.search(rf"^ *(?:import|from) {library}\b", text, re.MULTILINE):
                assert path.relative_to(RUNTIME).as_posix().startswith(homes), (library, path)


def test_the_core_has_neither_casadi_nor_matplotlib():
    wanted = {"filelock", "jinja2", "numpy", "scipy", "sympy"}
    assert names(PROJECT["dependencies"]) == wanted


def test_plan_and_casadi_functions_name_the_extra(without):
    without("casadi")
    model = st.load(zoo.folder("m1_n1"))
    with missing("plan"):
        _ = model.casadi
    with missing("plan"):
        st.plan(model, start=None, duration=None)
    assert model.energy([0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8)[0] == 0


def test_a_scenes_plan_is_refused_before_its_model_is_made(without, monkeypatch, capsys):
    without("casadi")
    monkeypatch.setattr(building, "generated", lambda *_: pytest.fail("it was generated"))
    with missing("plan"):
        planned("righting_m1_n3")
    assert cli.main(["plan", "righting_m1_n3"]) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.count("\n") == 1 and 'pip install "serpentail[plan]"' in error


def test_laws_about_casadi_say_that_they_were_not_checked(without):
    without("casadi")
    checks = report.laws(st.load(zoo.folder("bare")))
    skipped = {check.name for check in checks if "serpentail[plan]" in check.omitted}
    assert skipped == {"casadi functions agree", "casadi externals are the compiled code"}
    assert all(check.passed for check in checks)


def test_pictures_name_the_extra(without, tmp_path, monkeypatch, capsys):
    without("matplotlib")
    for kind in ("png", "gif", "svg"):
        with row(kind), missing("plot"):
            st.film(flight(), tmp_path / f"film.{kind}")
    assert list(tmp_path.iterdir()) == []
    for draw in (st.filmstrip, st.plot):
        with missing("plot"):
            draw(flight())
    monkeypatch.setattr(cli, "run", lambda _: pytest.fail("it ran"))
    assert cli.main(["simulate", "kick", "--film", "kick.png"]) == 2
    assert 'pip install "serpentail[plot]"' in capsys.readouterr().err

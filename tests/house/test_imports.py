"""Importing is light: a package is loaded only by those who use it; what needs a library of an
extra names the extra before it works, and all else does without.
"""

import importlib
import pkgutil
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import serpentail as st
from serpentail.building import build as building
from serpentail.cli import cli
from serpentail.scenes.plan import planned
from serpentail.verification import report
from tests.support import zoo
from tests.support.drawn_flight import flight
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
HEAVY = ["casadi", "jinja2", "matplotlib", "mpmath", "numpy", "scipy", "serpentail_codegen"]
HEAVY += ["pandas", "serpentail.bridges.containers", "serpentail.show.page", "sympy", "xarray"]
FLIGHT = """
import sys, serpentail as st
model = st.load(sys.argv[1])
settings = {"controller": st.Damping(), "t_span": 0.01}
flight = st.simulate(model, [0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8, **settings)
assert len(flight.t) == 201 and st.Rollouts and st.Plan
"""
# of the generator, what works without SymPy
BARE = ("ir.tape", "ir.interpret", "autodiff.reverse", "passes.schedule", "scene.parse")
BARE += ("targets.write", "targets.templating", "targets.expressions", "targets.c.routine")


def loaded(program, *arguments):
    """The heavy packages that a new interpreter has loaded after a program."""
    asked = f"\nimport sys; print(*[name for name in {HEAVY} if name in sys.modules])"
    command = [sys.executable, "-W", "error", "-c", program + asked, *map(str, arguments)]
    return set(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split())


def test_heavy_packages_are_loaded_by_those_who_use_them():
    generator = "import serpentail_codegen.scene.parse, serpentail_codegen.__main__"
    assert loaded("import serpentail") == set()
    assert loaded(generator) == {"serpentail_codegen"}
    assert loaded(FLIGHT, zoo.folder("m1_n1")) == {"numpy"}
    later = "import serpentail.cli.cli, serpentail.scenes.simulate, serpentail.planning.result.plan"
    assert "serpentail.show.page" not in loaded(later)
    # instead of its time, which hangs on the machine
    few = "import sys, contextlib, importlib, typing; old = {*sys.modules}; import serpentail; "
    assert loaded(few + "assert {*sys.modules} - old == {'serpentail'}") == set()
    of_tapes = "import " + ", ".join(f"serpentail_codegen.{name}" for name in BARE)
    assert "sympy" not in loaded(of_tapes)


def test_names_are_the_contract_and_no_module_hides_one():
    """Importing a submodule makes it an attribute of the package, in place of what is there."""
    assert sorted(st.__all__) == dir(st)
    for name in st.__all__:
        assert getattr(st, name).__name__ == name and getattr(st, name).__doc__
    modules = {module.name for module in pkgutil.iter_modules(st.__path__)}
    assert "motion" in modules and not modules & set(st.__all__)
    assert loaded("import serpentail as st; st.Damping; assert st.simulate.__name__") == {"numpy"}
    with pytest.raises(ImportError, match="simulat"):
        importlib.import_module("serpentail.simulat")


# Extras.

BROUGHT_ALONG = {"trimesh": "viser"}  # by a library of the extra
HOMES = {  # where alone a library of an extra may be imported, behind the room's gates
    "casadi": ("model/casadi.py", "optimal/", "planning/"),
    "matplotlib": ("show/pictures/",),
    "PIL": ("show/pictures/",),
    "imageio_ffmpeg": ("show/pictures/encode.py",),
    "ezc3d": ("identification/c3d_child.py",),
    "gymnasium": ("bridges/learning/environments.py",),
    "jax": ("bridges/differentiable/jax_calls.py", "bridges/differentiable/jax_functions.py"),
    "torch": ("bridges/differentiable/torch_functions.py",),
}


def missing(extra):
    return pytest.raises(st.ExtraMissing, match=rf'pip install "serpentail\[{extra}\]"')


def names(requirements):
    return {re.match(r"[\w-]+", text)[0] for text in requirements}


def test_libraries_of_extras_are_imported_in_their_rooms_behind_gates_that_name_the_extra():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    own = {"cloudpickle", "filelock", "jinja2", "numpy", "scipy", "sympy"}
    assert names(project["dependencies"]) == own
    runtime, gates = ROOT / "runtime" / "serpentail", set()
    for path in runtime.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        gates |= {*re.findall(r'\bneeded\("(\w+)", "(\w+)"\)', text)}
        for library, homes in HOMES.items():
            if re.search(rf"^ *(?:import|from) {library}\b", text, re.MULTILINE):
                assert path.relative_to(runtime).as_posix().startswith(homes), (library, path)
    assert len(gates) >= 7
    for module, extra in gates:
        brought = names(project["optional-dependencies"][extra])
        assert BROUGHT_ALONG.get(module, module) in brought


def test_casadi_names_the_extra_before_a_model_is_made(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "casadi", None)
    model = st.load(zoo.folder("m1_n1"))
    with missing("plan"):
        _ = model.casadi
    with missing("plan"):
        st.plan(model, start=None, duration=None)
    assert model.energy([0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8)[0] == 0
    checks = report.laws(st.load(zoo.folder("bare")))
    skipped = {check.name for check in checks if "serpentail[plan]" in check.omitted}
    assert skipped == {"casadi functions agree", "casadi externals are the compiled code"}
    assert all(check.passed for check in checks)
    monkeypatch.setattr(building, "generated", lambda *_: pytest.fail("it was generated"))
    with missing("plan"):
        planned("righting_m1_n3")
    assert cli.main(["plan", "righting_m1_n3"]) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.count("\n") == 1 and 'pip install "serpentail[plan]"' in error


def test_pictures_name_the_extra(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
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

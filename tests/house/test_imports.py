"""Importing is light: a package is loaded only by those who use it."""

import importlib
import pkgutil
import subprocess
import sys

import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

HEAVY = ["casadi", "jinja2", "matplotlib", "mpmath", "numpy", "scipy", "serpentail_codegen"]
HEAVY += ["serpentail.viewer", "sympy"]
FLIGHT = """
import sys, serpentail as st
model = st.load(sys.argv[1])
settings = {"controller": st.Damping(), "t_span": 0.01}
flight = st.simulate(model, [0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8, **settings)
assert len(flight.t) == 201
"""
PICTURES_LATER = (
    "import serpentail.cli, serpentail.scenes.simulate, serpentail.planning.result.plan"
)
# of the generator, what works without SymPy
BARE = ("ir.tape", "ir.interpret", "autodiff.reverse", "passes.schedule", "scene.parse")
BARE += ("targets.write", "targets.templating", "targets.expressions", "targets.c.routine")


def fresh(program, *arguments):
    """What a new interpreter prints."""
    command = [sys.executable, "-W", "error", "-c", program, *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def loaded(program, *arguments):
    """The heavy packages that a new interpreter has loaded after a program."""
    asked = f"\nimport sys; print(*[name for name in {HEAVY} if name in sys.modules])"
    return set(fresh(program + asked, *arguments).split())


def test_heavy_packages_are_loaded_by_those_who_use_them():
    generator = "import serpentail_codegen.scene.parse, serpentail_codegen.__main__"
    for program, wanted, arguments in [
        ("import serpentail", set(), []),
        (generator, {"serpentail_codegen"}, []),
        (FLIGHT, {"numpy"}, [zoo.folder("m1_n1")]),
    ]:
        with row(program):
            assert loaded(program, *arguments) == wanted
    assert "serpentail.viewer" not in loaded(PICTURES_LATER)


def test_importing_the_runtime_loads_few_modules():
    """Instead of its time, which hangs on the machine: typing, contextlib and importlib."""
    program = "import sys; old = set(sys.modules); import serpentail; print(len({*sys.modules} - "
    assert int(fresh(f"{program} old))")) < 20


def test_tape_programs_and_printers_work_without_sympy_and_a_derivation_does_not():
    names = ", ".join(f"serpentail_codegen.{name}" for name in BARE)
    lines = [f"import sys; sys.modules['sympy'] = None; import {names}", "try:"]
    lines += ["    import serpentail_codegen.mechanics.lower", "except ImportError as e: print(e)"]
    assert "sympy" in fresh("\n".join(lines))


def test_names_are_the_contract():
    assert {"load", "Model", "simulate", "Damping", "TorqueTable", "Trajectory"} <= set(dir(st))
    assert sorted(st.__all__) == dir(st)
    for name in st.__all__:
        assert getattr(st, name).__name__ == name and getattr(st, name).__doc__


def test_no_module_hides_a_public_name():
    """Importing a submodule makes it an attribute of the package, in place of what is there."""
    modules = {module.name for module in pkgutil.iter_modules(st.__path__)}
    assert "motion" in modules and not modules & set(st.__all__)
    assert fresh("import serpentail as st; st.Damping; print(st.simulate.__name__)") == "simulate\n"


def test_unknown_name_lists_the_public_ones():
    with pytest.raises(AttributeError, match="'simulat'") as caught:
        _ = st.simulat
    assert all(name in str(caught.value) for name in st.__all__)
    with pytest.raises(ImportError, match="simulat"):
        importlib.import_module("serpentail.simulat")

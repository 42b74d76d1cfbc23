"""Importing the runtime is quick, and a package is loaded only by those who use it."""

import importlib
import pkgutil
import subprocess
import sys

import pytest

import serpentail as st
from tests.support.models import model_folder

HEAVY = ["casadi", "jinja2", "matplotlib", "numpy", "scipy", "serpentail_codegen", "sympy"]
LOADED = f"import sys; print(*[name for name in {HEAVY} if name in sys.modules])"


def fresh(program, *arguments):
    """What a new interpreter prints."""
    command = [sys.executable, "-W", "error", "-c", program, *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def test_import_takes_less_than_150_ms():
    program = (
        "import time; start = time.perf_counter(); import serpentail; print(time.perf_counter() - "
        "start)"
    )
    assert min(float(fresh(program)) for _ in range(5)) < 0.15


def test_import_loads_no_other_package():
    assert fresh(f"import serpentail; {LOADED}").split() == []


def test_flight_needs_numpy_alone():
    folder = model_folder(1, 1, functions=["energy", "momentum", "rollout"])
    program = (
        "import sys, serpentail as st\n"
        "model = st.load(sys.argv[1])\n"
        "flight = st.simulate(model, [0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8, "
        "controller=st.Damping(), t_span=0.01)\n"
        f"assert len(flight.t) == 201; {LOADED}"
    )
    assert fresh(program, folder).split() == ["numpy"]


def test_what_draws_is_not_loaded_before_it_is_asked_for():
    program = (
        "import sys, serpentail.cli, serpentail.scenes.simulate, serpentail.planning.result.plan\n"
        "print([name for name in sys.modules if name.startswith('serpentail.viewer')])"
    )
    assert fresh(program) == "[]\n"


@pytest.mark.parametrize("name", st.__all__)
def test_public_name_is_documented(name):
    assert getattr(st, name).__name__ == name
    assert getattr(st, name).__doc__


def test_names_are_the_contract():
    assert {"load", "Model", "simulate", "Damping", "TorqueTable", "Trajectory"} <= set(dir(st))
    assert sorted(st.__all__) == dir(st)


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

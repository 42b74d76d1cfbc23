"""What editors, mypy and people are told of the package's names.

``make golden`` writes runtime/serpentail/__init__.pyi anew.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import serpentail as st
from serpentail.simulation.settings import VariedRuns
from tests.support import zoo
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
STUB = ROOT / "runtime" / "serpentail" / "__init__.pyi"
HEAD = '"""The public names, for editors and type checkers; `make golden` writes this file."""\n\n'
RIGHT = """\
from typing import Any, assert_type
import numpy as np
import serpentail as st
model = st.build(tail="articulated", segments=1, links=3, tail_mass="4 g", torso_mass=0.1)
start, row = model.state(height="30 cm", pitch="20 deg", bend=[0.1, "5 deg"]), [0.0, 1, 1] * 3
law = st.Damping("1e-4 N m s")
flight = assert_type(st.simulate(model, start, "0.4 s", controller=law), st.Trajectory)
assert_type(st.simulate(model, row, [0.0] * 8, t_span=("0", 0.4), rtol=1e-9), st.Trajectory)
assert_type(st.simulate(model, [row, row], [0.0] * 8, threads=2), st.Rollouts)
assert_type(st.simulate(model, start.q, start.v), Any)
many = st.simulate(model, np.tile(start.q, (9, 1)), start.v, parameters={"tail_mass": [4e-3] * 9})
end: st.State = many[0].end
plan = assert_type(st.plan(model, start=end, duration="0.3 s", damping="1e-4 N m s"), st.Plan)
height: float = flight.q[-1, 2] + plan.trajectory["z"].max()
kick = st.scenario("kick", changes={"mu": 0.4})
assert_type(kick.simulate(output_step="1 ms"), st.Trajectory)
st.Sequence(model, [st.Phase("fall", "0.3 s", until="landing")]).simulate(start).trajectory.view()
prior, marks = st.TorquePrior("4 mN m", 0.03), {"tip": st.Marker(tail=1.0)}
assert_type(st.identify(model, "a.trc", marks, torques=prior), st.Identification)
assert_type(st.sweep(model, {"tail_mass": st.grid([0.003, 0.004])}), st.Sweep)
"""
WRONG = """\
import serpentail as st
model = st.load("generated/rat", {"tail_mass": "3 g"})
start = model.state(height=0.3)
model.state(heigth=0.3)  # wrong
st.compare([st.simulate(model, start), 3])  # wrong
st.nonsense()  # wrong
st.simulate(model, start, controler=st.Damping(1e-4))  # wrong
st.plan(model, start=start, duration=0.3, bound=st.Bounds(torque=0.01))  # wrong
model.forward_dynamics(start.q, start.v)  # wrong
h: str = model.mass_matrix(start.q)  # wrong
st.simulate(model, start, t_span={"end": 0.4})  # wrong
"""


def test_the_stub_has_each_public_name_from_its_home(request):
    lines = [f"from .{home} import {name} as {name}\n" for name, home in st._HOME.items()]
    made = HEAD + "".join(lines) + "\n__version__: str\n"
    if request.config.getoption("--update-golden"):
        STUB.write_text(made, encoding="utf-8")
    else:
        assert STUB.read_text(encoding="utf-8") == made, "run `make golden`"


@pytest.mark.slow
def test_mypy_finds_a_users_mistakes_and_no_others(tmp_path):
    pytest.importorskip("mypy")
    for script in (RIGHT, WRONG):
        (tmp_path / "user.py").write_text(script, encoding="utf-8")
        words = ["-m", "mypy", "--strict", "--config-file=", f"--cache-dir={ROOT}/.build/mypy"]
        command = [sys.executable, *words, "user.py"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        found = {int(line) for line in re.findall(r"user\.py:(\d+): error", done.stdout)}
        lines = enumerate(script.splitlines(), start=1)
        wanted = {k for k, line in lines if line.endswith("# wrong")}
        assert found == wanted and done.returncode == bool(wanted), done.stdout + done.stderr


def test_types_know_every_argument_of_simulate():
    told = st.simulate.__doc__.split("See Also")[0]
    told = ", ".join(re.findall(r"^    ([a-z]\w*(?:, \w+)*) : ", told, re.MULTILINE))
    assert {*VariedRuns.__annotations__} == {*told.split(", ")} - {"model", "q0", "v0", "t_span"}


def test_a_name_that_does_not_exist_tells_the_nearest_three():
    model = zoo.model("m1_n1")
    motion = st.simulate(model, model.neutral(), 0.01)
    rows = {  # what is asked, of what, the name that was meant
        "Simulat": (st, "simulate"),
        "read_trc": (st, "read_markers"),
        "mass_matrx": (model, "mass_matrix"),
        "kinetics": (motion, "kinetic"),
        "name": (motion.end, "names"),
        "phase": (st.Sequence(model, [st.Phase("fall", 1)]), "phases"),
    }
    for asked, (whole, meant) in rows.items():
        with row(asked), pytest.raises(AttributeError, match=f"'{asked}'") as caught:
            getattr(whole, asked)
        near = str(caught.value).split(" are ")[1].split(", ")
        assert near[0] == meant and len(near) == 3 and {*near} <= {*dir(whole)}
    for whole in (st, model, motion):  # tools ask for many of these
        with pytest.raises(AttributeError, match=r"'_simulate'$"):
            _ = whole._simulate
    for whole, name, place in (
        (model, "tail_mass", ".parameters['tail_mass']"),
        (motion, "tau_alpha_1", "['tau_alpha_1']"),
        (motion.end, "z", "['z']"),
    ):
        with row(name), pytest.raises(AttributeError, match=re.escape(f"take {place}")):
            getattr(whole, name)
        eval(f"whole{place}", {"whole": whole})  # is there
    with pytest.raises(KeyError, match=r"'tilt_end'.*are tilt_end_deg, "):
        motion.summary()["tilt_end"]
    assert not hasattr(motion, "_ipython_display_")  # asked in silence, by notebooks
    with pytest.raises(AttributeError, match="not given"):  # what a property raises stays
        _ = object.__new__(st.Trajectory).energy

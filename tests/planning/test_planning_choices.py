"""Designs as scenes and the command line give them, and designs that are refused."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.scenes.plan import arguments_for
from tests.support.models import model_folder
from tests.support.tumbling import DURATION, rat, start

RANGE = (0.08, 0.25)


@pytest.mark.parametrize(
    ("design", "words"),
    [
        (3, "design: value 3: needs a mapping of parameters, such as {'tail_length'"),
        ({"tail_lenght": RANGE}, "design.tail_lenght: no such parameter; did you mean 'tail_len"),
        ({"tail_length": 0.1}, "design.tail_length: value 0.1: needs (least, most)"),
        ({"tail_length": (0.2, 0.1)}, "design.tail_length: value (0.2, 0.1): needs least below mo"),
        ({"tail_length": (0.2, 0.2)}, "needs least below most"),
        ({"tail_mass": (-0.1, 0.1)}, "design.tail_mass: value -0.1: needs a finite number (kg), a"),
        ({"tail_mass": (0.1, float("nan"))}, "design.tail_mass: value nan"),
        ({"tail_mass": ("1 m", "2 m")}, "design.tail_mass: value '1 m'"),
        (
            {"torso_inertia": ((1e-5, 1e-5, 1e-5), (1e-5, 1e-5, 3e-5))},
            "design.torso_inertia: value (1e-05, 1e-05, 3e-05): needs",
        ),
        (
            {"link_radius": (1e-3, 2e-3), "link_inertia": (1e-8, 1e-7)},
            "design.link_inertia: value 1e-08: needs 3 finite numbers",
        ),
        (
            {"link_radius": (1e-3, 2e-3), "link_inertia": ([1e-8] * 3, [1e-7] * 3)},
            "design: parameters: link_radius and link_inertia: give one of them, not both",
        ),
    ],
)
def test_wrong_designs_are_refused(design, words):
    with pytest.raises(st.PlanningError) as caught:
        st.plan(rat(), start=start(rat()), duration=DURATION, design=design)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"solver": "fatrop"}, "solver: value 'fatrop': design is given: it takes known"),
        ({"dynamics": "compiled"}, "dynamics: value 'compiled': compiled C takes the parameters"),
    ],
)
def test_what_takes_known_parameters_says_so(settings, words):
    with pytest.raises(st.PlanningError, match=words):
        st.plan(
            rat(), start=start(rat()), duration=DURATION, design={"tail_length": RANGE}, **settings
        )


def test_parameters_that_do_nothing_are_refused():
    """Those of contacts: a plan flies."""
    model = st.load(model_folder(1, 2, contacts=["torso"]))
    name = next(name for name in model.parameters if name.startswith("K_"))
    value = model.parameters[name]
    with pytest.raises(st.PlanningError, match=f"design: value '{name}': nothing in this plan"):
        q, v = np.r_[0, 0, 1, 1, np.zeros(model.nq - 4)], np.zeros(model.nv)
        v[3] = 5
        st.plan(model, start=(q, v), duration=DURATION, design={name: (value, 2 * value)})


SCENE = """
[plan]
duration = 0.4
intervals = 8
design.tail_length = ["16 cm", 0.24]
free_start.tail = [[-0.2, "-5 deg"], [0.2, 0.1]]
"""


def test_command_line_takes_both(tmp_path, capsys):
    model = rat()
    q, v = start(model)
    (tmp_path / "own.toml").write_text(
        f"{SCENE}start.q = {q.tolist()}\nstart.v = {v.tolist()}\nbounds.angle = 1.0\n"
    )
    saved, folder = tmp_path / "own.npz", str(model.folder)
    given = [str(tmp_path / "own.toml"), "--folder", folder, "--json", "-", "--save", str(saved)]
    assert cli.main(["plan", *given]) == 0
    report, motion = json.loads(capsys.readouterr().out), st.Trajectory.load(saved)
    length = report["design"]["tail_length"]
    assert report["success"] and 0.16 <= length <= 0.24
    assert motion.info["parameters"]["tail_length"] == length
    assert report["start"]["tail"] == pytest.approx(motion.q[0, 7:], abs=1e-6)
    assert set(report["design_slopes"]) == {"tail_length"}


def test_a_scaled_scene_scales_its_ranges():
    """By the parameter's unit: an inertia is a mass times a square of a length."""
    manifest = rat().manifest | {"size": {"kg": 8.0, "m": 2.0, "s": 1.0}}
    body = SimpleNamespace(manifest=manifest)
    table = {"start": {"q": [0], "v": [0]}, "duration": 1}
    inertias = [[1e-5, 1e-5, 1e-5], ["20 g mm^2", 1e-5, 1e-5]]
    table["design"] = {"tail_length": ["10 cm", 0.2], "torso_inertia": inertias, "tale": 3}
    found = arguments_for(body, table)["design"]
    np.testing.assert_allclose(found["tail_length"], [0.2, 0.4])
    np.testing.assert_allclose(found["torso_inertia"], [[32e-5] * 3, [64e-8, 32e-5, 32e-5]])
    assert found["tale"] == 3

"""Every packaged scene in every kind of file: it is read as the model, or refused with a remedy
that works.
"""

import zipfile

import numpy as np
import pytest

import serpentail as st
from serpentail.bridges.exporting.export import SUFFIXES
from serpentail.building.examples import example_paths
from tests.support.rows import row

from .test_chains import mujoco, pin, unbalanced

QUICK = "identify_tail"  # others take seconds to make


def read_urdf(model, path, _):
    read = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer(), True)
    assert (read.nq, read.nv) == (model.nq, model.nv)
    assert f"<!-- {model.name}, made by serpentail {st.__version__}. SI" in path.read_text()


def read_mjcf(model, path, _):
    q, v = np.random.default_rng(5).normal(scale=0.1, size=(2, model.nq))
    lacking = unbalanced(model, mujoco.MjModel.from_xml_path(str(path)), q, v[1:])
    assert np.abs(lacking).max() < 1e-12 * max(1, model.total_mass)  # N; a runner weighs kilograms


def read_bundle(model, path, _):
    folder = path.with_suffix("")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    (unpacked,) = folder.iterdir()
    assert st.load(unpacked).checked.manifest_hash == model.checked.manifest_hash


def read_fmu(model, path, opened):
    one, known, _ = opened(path, "Model")
    q = one.getReal([known[f"q[{k + 1}]"] for k in range(model.nq)])
    rates = one.getReal([known[f"der(v[{k + 1}])"] for k in range(model.nv)])
    expected = model.forward_dynamics(q, np.zeros(model.nv), np.zeros(model.nv - 6))
    np.testing.assert_allclose(rates, expected, rtol=1e-9, atol=1e-9)


READERS = {"urdf": read_urdf, "mjcf": read_mjcf, "bundle": read_bundle, "fmu": read_fmu}
REMEDIES = {  # words of a refusal -> the model and the kind that they lead to
    'export an "fmu"': lambda model, _: (model, "fmu"),
    'export an "mjcf"': lambda model, _: (model, "mjcf"),
    'export a "bundle"': lambda model, _: (model, "bundle"),
    "with tail_stiffness = 0": lambda model, kind: (model.with_parameters(tail_stiffness=0), kind),
    "with hind_stiffness = 0": lambda model, kind: (model.with_parameters(hind_stiffness=0), kind),
    'kind = "articulated" and some links': lambda model, kind: (
        st.build(tail="articulated", segments=model.segments, links=2),
        kind,
    ),
}


def check(model, kind, folder, opened):
    path = st.export(model, kind, folder / f"{kind}{SUFFIXES[kind][-1]}")
    READERS[kind](model, path, opened)


MARKED = [pytest.param(n, marks=[pytest.mark.slow] * (n != QUICK)) for n in example_paths()]


@pytest.mark.parametrize("name", MARKED)
def test_a_packaged_scene_is_exported_or_a_remedy_of_its_refusal_works(name, tmp_path, opened):
    model = st.build(name)
    for kind in SUFFIXES:
        with row(kind):
            try:
                check(model, kind, tmp_path, opened)
            except st.SerpentailError as refusal:
                ways = [led for words, led in REMEDIES.items() if words in str(refusal)]
                assert ways, refusal
                for led in ways:
                    check(*led(model, kind), tmp_path, opened)

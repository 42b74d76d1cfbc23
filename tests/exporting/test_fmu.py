"""FMUs: FMPy finds nothing wrong, and they fly as the model does, by either kind of interface."""

import shutil
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.validation import validate_fmu

import serpentail as st
from tests.support.models import model_folder

TAILS = {"articulated": (2, 3), "continuum": (2, None)}
SPAN = 0.2  # s


@pytest.fixture(scope="module", params=TAILS)
def model(request):
    loaded = st.load(model_folder(*TAILS[request.param]))
    return loaded.with_parameters(torso_mass=0.11, torso_inertia=(7e-5, 4e-5, 6e-5))


@pytest.fixture(scope="module")
def path(model, tmp_path_factory):
    return st.export(model, "fmu", tmp_path_factory.mktemp("fmu") / "rat.fmu")


@pytest.fixture(scope="module")
def described(path):
    return fmpy.read_model_description(str(path))


@pytest.fixture
def unit(path, described, tmp_path, request):
    """Return a unit of a kind by its interface, initialised; gone at the end."""
    folder = tmp_path / "unit"
    fmpy.extract(str(path), str(folder))
    opened = []

    def made(kind, tolerance=None):
        name = described.modelExchange.modelIdentifier
        found = kind(
            guid=described.guid,
            unzipDirectory=str(folder),
            modelIdentifier=name,
            instanceName="rat",
        )
        found.instantiate()
        found.setupExperiment(startTime=0.0, tolerance=tolerance)
        found.enterInitializationMode()
        found.exitInitializationMode()
        opened.append(found)
        return found

    yield made
    for each in opened:
        each.terminate()
        each.freeInstance()
    shutil.rmtree(folder)


def names(model):
    """Names of the states."""
    return [f"{x}[{k + 1}]" for x, n in (("q", model.nq), ("v", model.nv)) for k in range(n)]


def state(model, seed=1):
    """A state (q, v) that tumbles, and torques."""
    rng = np.random.default_rng(seed)
    q = rng.normal(scale=0.3, size=model.nq)
    q[3:7] = [0.9, 0.1, -0.2, 0.3]
    q[3:7] /= np.linalg.norm(q[3:7])
    return q, rng.normal(size=model.nv), rng.normal(scale=1e-5, size=model.nv - 6)


def test_fmpy_finds_nothing_wrong(path):
    assert validate_fmu(str(path)) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_it_flies_as_the_model_does(kind, model, path):
    q, v, tau = state(model)
    run = st.simulate(
        model, q, v, controller=lambda *_: tau, t_span=SPAN, output_step=0.01, rtol=1e-11
    )
    start = dict(zip(names(model), [*q, *v], strict=True))
    start |= {f"tau[{k + 1}]": value for k, value in enumerate(tau)}
    solver = {"solver": "CVode"} if kind == "ModelExchange" else {}
    rows = fmpy.simulate_fmu(
        str(path),
        fmi_type=kind,
        start_values=start,
        stop_time=SPAN,
        output_interval=0.01,
        relative_tolerance=1e-9,
        **solver,
    )
    assert rows["time"] == pytest.approx(run.t)
    flown = np.array([rows[name] for name in names(model)]).T
    most = {"CoSimulation": 1e-7, "ModelExchange": 1e-5}[kind]  # CVode's own tolerance
    assert np.abs(flown - np.hstack([run.q, run.v])).max() < most


def references(described):
    """Value references by name."""
    return {each.name: each.valueReference for each in described.modelVariables}


def put(unit, references, values):
    unit.setReal([references[name] for name in values], list(values.values()))


def test_accelerations_are_the_models(model, unit, described):
    q, v, tau = state(model)
    q[3:7] *= 1.7  # a quaternion of any norm
    one, known = unit(FMU2Model), references(described)
    put(one, known, dict(zip(names(model), [*q, *v], strict=True)))
    put(one, known, {f"tau[{k + 1}]": value for k, value in enumerate(tau)})
    found = one.getReal([known[f"der(v[{k + 1}])"] for k in range(model.nv)])
    expected = model.forward_dynamics(q, v, tau)
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-9)


def test_directional_derivatives_are_exact(model, unit, described):
    """By differences of the rates themselves, at a quaternion that is no unit one."""
    q, v, tau = state(model)
    q[3:7] *= 1.3
    one, known = unit(FMU2Model), references(described)
    knowns = [known[name] for name in names(model)] + [
        known[f"tau[{k + 1}]"] for k in range(len(tau))
    ]
    unknowns = [known[f"der({name})"] for name in names(model)]
    at, rng = np.concatenate([q, v, tau]), np.random.default_rng(5)
    for scale in (np.repeat([1, 1, 0.0], [model.nq, model.nv, len(tau)]), np.ones(len(at))):
        along = (
            scale
            * rng.normal(size=len(at))
            * np.where(np.arange(len(at)) < len(at) - len(tau), 1, 1e-4)
        )
        one.setReal(knowns, list(at))
        exact = np.array(one.getDirectionalDerivative(unknowns, knowns, list(along)))
        rates = []
        for step in (-2, -1, 1, 2):
            one.setReal(knowns, list(at + 1e-4 * step * along))
            rates.append(np.array(one.getReal(unknowns)))
        differences = (rates[0] - 8 * rates[1] + 8 * rates[2] - rates[3]) / 12e-4
        np.testing.assert_allclose(exact, differences, atol=1e-8 * np.abs(exact).max())


def test_states_are_outputs_of_which_the_derivative_is_the_identity(unit, described):
    one = unit(FMU2Model)
    assert one.getDirectionalDerivative([0, 3, 5], [3, 5], [2.0, 7.0]) == [0.0, 2.0, 7.0]


def test_a_state_is_kept_stored_and_restored(model, unit, described):
    q, v, _ = state(model)
    one, known = unit(FMU2Slave), references(described)
    put(one, known, dict(zip(names(model), [*q, *v], strict=True)))
    one.doStep(0.0, 0.01)
    kept = one.getFMUstate()
    stored = one.serializeFMUstate(kept)

    def flown(of):
        of.doStep(0.01, 0.02)
        return of.getReal([known[name] for name in names(model)])

    first = flown(one)
    one.setFMUstate(kept)
    assert flown(one) == first
    another = unit(FMU2Slave)
    restored = another.deSerializeFMUstate(stored)
    another.setFMUstate(restored)
    assert flown(another) == first
    another.freeFMUstate(restored)
    one.freeFMUstate(kept)


def test_parameters_are_those_of_the_model_and_can_be_tuned(model, unit, described):
    start = {each.name: float(each.start) for each in described.modelVariables if each.start}
    assert start["torso_mass"] == 0.11
    assert [start[f"torso_inertia[{k}]"] for k in (1, 2, 3)] == [7e-5, 4e-5, 6e-5]
    q, v, tau = state(model)
    one, known = unit(FMU2Model), references(described)
    put(one, known, dict(zip(names(model), [*q, *v], strict=True)))
    put(one, known, {f"tau[{k + 1}]": value for k, value in enumerate(tau)})
    changed = {"gravity": 1.6, "tail_mass": 0.005}
    put(one, known, changed)
    if model.links:  # the FMU has no link_radius, from which this would follow
        changed["link_inertia"] = model.parameters["link_inertia"]
    expected = model.with_parameters(**changed).forward_dynamics(q, v, tau)
    found = one.getReal([known[f"der(v[{k + 1}])"] for k in range(model.nv)])
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-9)
    one.reset()
    assert one.getReal([known["gravity"], known["q[4]"], known["q[1]"]]) == [9.8, 1.0, 0.0]


def test_variables_have_units_and_parts(described):
    units = {each.name: each.unit for each in described.modelVariables}
    expected = {"q[1]": "m", "q[4]": "1", "q[8]": "rad", "v[1]": "m/s", "v[4]": "rad/s"}
    expected |= {
        "der(v[1])": "m/s2",
        "der(v[4])": "rad/s2",
        "tau[1]": "N.m",
        "torso_inertia[2]": "kg.m2",
    }
    assert {name: units[name] for name in expected} == expected
    defined = {each.name: each.baseUnit for each in described.unitDefinitions}
    torque = defined["N.m"]
    assert (torque.kg, torque.m, torque.s) == (1, 2, -2)
    parts = {each.name: (each.causality, each.variability) for each in described.modelVariables}
    assert parts["gravity"] == ("parameter", "tunable")
    assert parts["q[1]"] == ("output", "continuous") and parts["tau[1]"] == ("input", "continuous")


def test_its_files_are_the_same_twice(model, path, tmp_path):
    again = st.export(model, "fmu", tmp_path / "again.fmu")
    assert again.read_bytes() == path.read_bytes()
    with zipfile.ZipFile(path) as archive:
        files = archive.namelist()
    assert f"binaries/linux64/{model.name}.so" in files and "modelDescription.xml" in files

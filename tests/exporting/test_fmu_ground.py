"""FMUs of models that touch the ground: they land as the model does, and tell of each contact."""

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import serpentail as st
from tests.exporting.sources import compiled
from tests.support.models import model_folder

FEET = {"size": (1, 3), "contacts": ["feet", "tail", "torso"], "functions": ["implicit"]}
TAIL = {"size": (2, None), "contacts": ["tail"], "functions": []}  # without an implicit method
CALLED = ["contact_dynamics", "contact_points", "rollout", "energy", "momentum"]
LEGS = np.array([3.7, -0.7, 3.7, -0.7, 0, -0.5, 0, -0.5])  # rad, rad/s: crouched, stretching
SPAN, STEP = 0.05, 5e-4  # s


@pytest.fixture(scope="module", params=[FEET, TAIL], ids=["feet", "tail"])
def model(request):
    size, contacts, more = request.param.values()
    return st.load(model_folder(*size, contacts=contacts, functions=[*CALLED, *more]))


@pytest.fixture(scope="module")
def path(model, tmp_path_factory):
    return st.export(model, "fmu", tmp_path_factory.mktemp("fmu") / "rat.fmu")


def legs_of(model):
    """The argument of functions that know of legs."""
    return (LEGS,) if "feet" in model.contacts else ()


@pytest.fixture(scope="module")
def landing(model):
    """A motion that begins 4 mm above the ground, while the legs stretch."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3:7] = np.array([1, 0.05, 0, 0]) / np.hypot(1, 0.05)
    q[7::2], v[2], v[4] = (-0.2 if legs_of(model) else 0.2), -0.3, 1.0
    q[2] = 0.004 - model.contact_points(q, v, *legs_of(model))[0][:, 2].min()
    held = {}
    if legs_of(model):
        ends = np.array([LEGS[:4], LEGS[:4] + LEGS[4:]])
        held["legs"] = st.Legs([0, 1], ends[:, 0::2], ends[:, 1::2])
    settings = {"t_span": SPAN, "output_step": STEP, "method": "tsit5", "rtol": 1e-10}
    return st.simulate(model, q, v, **settings, **held)


def start_values(model, run):
    """The start of a motion, and what moves the legs."""
    values = {"q": run.q[0], "v": run.v[0], "legs": LEGS if legs_of(model) else []}
    return {f"{name}[{k + 1}]": x for name, row in values.items() for k, x in enumerate(row)}


def moves(model):
    """What fmpy moves the legs by: their angles at both ends, straight in between."""
    if not legs_of(model):
        return None
    columns = [("time", float), *((f"legs[{k + 1}]", float) for k in range(8))]
    end = LEGS + np.append(SPAN * LEGS[4:], np.zeros(4))
    return np.array([(0.0, *LEGS), (SPAN, *end)], columns)


def names(model):
    """Names of q, v and bristles."""
    sizes = {"q": model.nq, "v": model.nv, "bristle": 2 * sum(model.contacts.values())}
    return [f"{name}[{k + 1}]" for name, size in sizes.items() for k in range(size)]


def test_fmpy_finds_nothing_wrong(path):
    assert validate_fmu(str(path)) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_it_lands_as_the_model_does(kind, model, path, landing):
    assert landing.info["events"][0]["group"] == next(iter(model.contacts))
    solver = {"solver": "CVode", "record_events": False} if kind == "ModelExchange" else {}
    rows = fmpy.simulate_fmu(
        str(path),
        fmi_type=kind,
        start_values=start_values(model, landing),
        input=moves(model),
        stop_time=SPAN,
        output_interval=STEP,
        relative_tolerance=1e-8,
        output=names(model),
        **solver,
    )
    assert rows["time"] == pytest.approx(landing.t)
    flown = np.array([rows[name] for name in names(model)]).T
    bristles = landing.contact.bristles.reshape(len(flown), -1)
    expected = np.hstack([landing.q, landing.v, bristles])
    assert np.abs(landing.contact.forces).max() > 0.1  # N: it has landed
    parts = (slice(model.nq), slice(model.nq, model.nq + model.nv), slice(-bristles.shape[1], None))
    limits = (5e-6, 1e-4 * np.abs(landing.v).max(), 1e-7)  # of q, v (m/s, rad/s), bristles (m)
    for part, most in zip(parts, limits, strict=True):
        assert np.abs(flown - expected)[:, part].max() < most


def test_touching_is_an_event(model, path, landing):
    """Model exchange stops where a point comes to the ground."""
    rows = fmpy.simulate_fmu(
        str(path),
        fmi_type="ModelExchange",
        start_values=start_values(model, landing),
        input=moves(model),
        stop_time=SPAN,
        output_interval=STEP,
        relative_tolerance=1e-8,
        output=["q[3]"],
        solver="CVode",
    )
    first = landing.info["events"][0]["time"]
    assert np.abs(rows["time"] - first).min() < 1e-6
    assert np.abs(landing.t - first).min() > 1e-5  # where no sample is


@pytest.fixture
def unit(path, tmp_path):
    """A unit for model exchange."""
    described = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path), str(tmp_path / "unit"))
    name = described.modelExchange.modelIdentifier
    place = {"unzipDirectory": folder, "modelIdentifier": name}
    found = fmpy.fmi2.FMU2Model(guid=described.guid, instanceName="rat", **place)
    found.instantiate()
    found.references = {each.name: each.valueReference for each in described.modelVariables}
    yield found
    found.freeInstance()


def test_event_indicators_are_heights_and_the_start_is_clear(model, path, unit, landing):
    count = sum(model.contacts.values())
    assert fmpy.read_model_description(str(path)).numberOfEventIndicators == count
    heights = np.zeros(count)
    unit.getEventIndicators(heights.ctypes.data_as(fmpy.fmi2.POINTER(fmpy.fmi2.c_double)), count)
    assert (heights > 0).all()
    values = start_values(model, landing)
    unit.setReal([unit.references[name] for name in values], list(values.values()))
    unit.getEventIndicators(heights.ctypes.data_as(fmpy.fmi2.POINTER(fmpy.fmi2.c_double)), count)
    points, _ = model.contact_points(landing.q[0], landing.v[0], *legs_of(model))
    np.testing.assert_allclose(heights, points[:, 2], atol=1e-12)


def test_sources_compile_without_a_warning(path, tmp_path):
    compiled(fmpy.extract(str(path), str(tmp_path / "unit")), tmp_path)


def test_there_are_no_directional_derivatives(path, unit):
    described = fmpy.read_model_description(str(path))
    assert not described.modelExchange.providesDirectionalDerivative
    with pytest.raises(fmpy.fmi1.FMICallException):
        unit.getDirectionalDerivative([0], [0], [1.0])

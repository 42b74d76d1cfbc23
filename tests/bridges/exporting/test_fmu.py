"""FMUs: FMPy finds nothing wrong, and they fly and land as the model does, by either interface."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.models import model_folder

pytest.importorskip("fmpy")
import fmpy
from fmpy.validation import validate_fmu

FLIGHTS = ("m2_n2", "arcs2")
LEGS = np.array([3.7, -0.7, 3.7, -0.7, 0, -0.5, 0, -0.5])  # rad, rad/s: crouched, stretching
SPAN, STEP = 0.05, 5e-4  # s, of a landing


def named(**vectors):
    """Entries of vectors by the names of their variables."""
    return {f"{x}[{k + 1}]": each for x, row in vectors.items() for k, each in enumerate(row)}


def names(model):
    bristles = range(2 * sum((model.contacts or {}).values()))
    return list(named(q=range(model.nq), v=range(model.nv), bristle=bristles))


def state(model, scale=1.0):
    """A state that tumbles, its quaternion of any norm, and torques."""
    rng = np.random.default_rng(1)
    q = rng.normal(scale=0.3, size=model.nq)
    q[3:7] = scale * np.array([0.9, 0.1, -0.2, 0.3]) / np.sqrt(0.95)
    v, tau = rng.normal(size=model.nv), rng.normal(scale=1e-5, size=model.nv - 6)
    return {"q": q, "v": v, "tau": tau}


def put(unit, references, values):
    unit.setReal([references[name] for name in values], list(values.values()))


def simulated(path, interface, start, span, step, **more):
    more |= {"fmi_type": interface, "start_values": start}
    return fmpy.simulate_fmu(str(path), stop_time=span, output_interval=step, **more)


def rates(one, known, model):
    return one.getReal([known[f"der({name})"] for name in named(v=range(model.nv))])


@pytest.mark.parametrize("name", [*FLIGHTS, "elastic"])
def test_it_flies_as_the_model_does(name, fmu):
    path, model = fmu(name), zoo.model(name)
    assert validate_fmu(str(path)) == []
    start, settings = state(model), {"t_span": 0.2, "output_step": 0.01, "rtol": 1e-11}
    held = {"controller": lambda *_: start["tau"]}
    run = st.simulate(model, start["q"], start["v"], **held, **settings)
    exchange = ("ModelExchange", 1e-5, {"solver": "CVode"})  # the limit is its own tolerance's
    for interface, most, more in (("CoSimulation", 1e-7, {}), exchange):
        more |= {"relative_tolerance": 1e-9}
        rows = simulated(path, interface, named(**start), 0.2, 0.01, **more)
        assert rows["time"] == pytest.approx(run.t)
        flown = np.array([rows[each] for each in names(model)]).T
        assert np.abs(flown - np.hstack([run.q, run.v])).max() < most, interface


@pytest.mark.parametrize("name", FLIGHTS)
def test_accelerations_and_directional_derivatives_are_exact(name, fmu, opened):
    """At a quaternion that is no unit one; derivatives by differences of the rates themselves."""
    model = zoo.model(name)
    start = state(model, scale=1.3)
    one, known, _ = opened(fmu(name), "Model")
    put(one, known, named(**start))
    found = rates(one, known, model)
    assert found == pytest.approx(model.forward_dynamics(**start), rel=1e-11, abs=1e-9)

    knowns = [known[each] for each in named(**start)]
    unknowns = [known[f"der({each})"] for each in names(model)]
    at, rng = np.concatenate([*start.values()]), np.random.default_rng(5)
    for torques in (0.0, 1e-4):
        along = rng.normal(size=len(at))
        along[model.nq + model.nv :] *= torques
        one.setReal(knowns, list(at))
        exact = np.array(one.getDirectionalDerivative(unknowns, knowns, list(along)))
        near = []
        for step in (-2, -1, 1, 2):
            one.setReal(knowns, list(at + 1e-4 * step * along))
            near.append(np.array(one.getReal(unknowns)))
        differences = (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / 12e-4
        np.testing.assert_allclose(exact, differences, atol=1e-8 * np.abs(exact).max())
    # states are outputs, of which the derivative is the identity
    assert one.getDirectionalDerivative([0, 3, 5], [3, 5], [2.0, 7.0]) == [0.0, 2.0, 7.0]


def test_a_state_is_kept_stored_and_restored(fmu, opened):
    model = zoo.model("m2_n2")
    one, known, _ = opened(fmu("m2_n2"), "Slave")
    put(one, known, named(**state(model)))
    one.doStep(0.0, 0.01)
    kept = one.getFMUstate()
    stored = one.serializeFMUstate(kept)

    def flown(of):
        of.doStep(0.01, 0.02)
        return of.getReal([known[name] for name in names(model)])

    first = flown(one)
    one.setFMUstate(kept)
    assert flown(one) == first
    another, *_ = opened(fmu("m2_n2"), "Slave")
    restored = another.deSerializeFMUstate(stored)
    another.setFMUstate(restored)
    assert flown(another) == first
    another.freeFMUstate(restored)
    one.freeFMUstate(kept)


@pytest.mark.parametrize("name", FLIGHTS)
def test_parameters_are_those_of_the_model_and_can_be_tuned(name, opened, tmp_path):
    model = zoo.model(name).with_parameters(torso_mass=0.11, torso_inertia=(7e-5, 4e-5, 6e-5))
    path = st.export(model, "fmu", tmp_path / "rat.fmu")
    described = fmpy.read_model_description(str(path))
    start = {each.name: float(each.start) for each in described.modelVariables if each.start}
    assert (start["torso_mass"], start["q[4]"], start["q[5]"]) == (0.11, 1.0, 0.0)
    assert [start[f"torso_inertia[{k}]"] for k in (1, 2, 3)] == [7e-5, 4e-5, 6e-5]
    one, known, _ = opened(path, "Model")
    changed = {"gravity": 1.6, "tail_mass": 0.005}
    put(one, known, named(**state(model)) | changed)
    if model.links:  # the FMU has no link_radius, from which this would follow
        changed["link_inertia"] = model.parameters["link_inertia"]
    expected = model.with_parameters(**changed).forward_dynamics(**state(model))
    assert rates(one, known, model) == pytest.approx(expected, rel=1e-11, abs=1e-9)
    one.reset()
    assert one.getReal([known["gravity"], known["q[4]"], known["q[1]"]]) == [9.8, 1.0, 0.0]


def test_the_description_has_units_and_parts_and_baked_parameters_are_no_variables(fmu, tmp_path):
    variables = fmpy.read_model_description(str(fmu("m2_n2"))).modelVariables
    units = {each.name: each.unit for each in variables}
    expected = {"q[1]": "m", "q[4]": "1", "q[8]": "rad", "v[1]": "m/s", "v[4]": "rad/s"}
    expected |= {"der(v[1])": "m/s2", "der(v[4])": "rad/s2", "tau[1]": "N.m"}
    expected["torso_inertia[2]"] = "kg.m2"
    assert {name: units[name] for name in expected} == expected
    parts = {each.name: (each.causality, each.variability) for each in variables}
    assert parts["gravity"] == ("parameter", "tunable")
    assert parts["q[1]"] == ("output", "continuous") and parts["tau[1]"] == ("input", "continuous")
    again = st.export(zoo.model("m2_n2"), "fmu", tmp_path / "again.fmu")
    assert again.read_bytes() == fmu("m2_n2").read_bytes()
    described = fmpy.read_model_description(str(fmu("baked")))
    assert not [each for each in described.modelVariables if each.causality == "parameter"]
    rows = simulated(fmu("baked"), "CoSimulation", {}, 0.1, 0.1, output=["v[3]"])
    assert rows["v[3]"][-1] == pytest.approx(-0.98, rel=1e-9)


def legs_of(model):
    """The argument of functions that know of legs."""
    return (LEGS,) if "feet" in model.contacts else ()


def landing(model):
    """A motion that begins 4 mm above the ground, while the legs stretch."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3:7] = np.array([1, 0.05, 0, 0]) / np.hypot(1, 0.05)
    q[7::2], v[2], v[4] = (-0.2 if legs_of(model) else 0.2), -0.3, 1.0
    q[2] = 0.004 - model.contact_points(q, v, *legs_of(model))[0][:, 2].min()
    settings = {"t_span": SPAN, "output_step": STEP, "method": "tsit5", "rtol": 1e-10}
    if legs_of(model):
        ends = np.array([LEGS[:4], LEGS[:4] + LEGS[4:]])
        settings["legs"] = st.Legs([0, 1], ends[:, 0::2], ends[:, 1::2])
    return st.simulate(model, q, v, **settings)


def start_values(model, run):
    """The start of a motion, and what moves the legs."""
    return named(q=run.q[0], v=run.v[0], legs=LEGS if legs_of(model) else [])


def landed(interface, model, path, run, **more):
    """Rows that FMPy finds; the legs' angles are straight lines."""
    if legs_of(model):
        columns = [("time", float), *((name, float) for name in named(legs=LEGS))]
        end = LEGS + np.append(SPAN * LEGS[4:], np.zeros(4))
        more["input"] = np.array([(0.0, *LEGS), (SPAN, *end)], columns)
    more |= {"relative_tolerance": 1e-8, "output": names(model)}
    return simulated(path, interface, start_values(model, run), SPAN, STEP, **more)


def check_landing(model, path):
    """Compare a unit's landing with its model's, by either interface."""
    assert validate_fmu(str(path)) == []
    run = landing(model)
    first = run.info["events"][0]
    assert np.abs(run.contact.forces).max() > 0.1  # N: it has landed
    bristles = run.contact.bristles.reshape(len(run.t), -1)
    expected = np.split(np.hstack([run.q, run.v, bristles]), [model.nq, model.nq + model.nv], 1)
    limits = (5e-6, 1e-4 * np.abs(run.v).max(), 1e-7)  # of q, v (m/s, rad/s), bristles (m)
    exchange = {"solver": "CVode", "record_events": False}
    for kind, more in (("CoSimulation", {}), ("ModelExchange", exchange)):
        rows = landed(kind, model, path, run, **more)
        assert rows["time"] == pytest.approx(run.t)
        flown = np.array([rows[name] for name in names(model)]).T
        parts = np.split(flown, [model.nq, model.nq + model.nv], 1)
        for part, wanted, most in zip(parts, expected, limits, strict=True):
            assert np.abs(part - wanted).max() < most, kind
    # model exchange stops where a point comes to the ground
    rows = landed("ModelExchange", model, path, run, solver="CVode")
    assert np.abs(rows["time"] - first["time"]).min() < 1e-6
    assert np.abs(run.t - first["time"]).min() > 1e-5  # where no sample is


def test_it_lands_as_the_model_does(fmu):
    check_landing(zoo.model("ground"), fmu("ground"))


@pytest.mark.slow
def test_a_tail_without_feet_and_implicit_method_lands_as_the_model_does(tmp_path):
    # each model of the zoo that touches the ground has feet and an implicit method
    functions = ["contact_dynamics", "contact_points", "rollout", "energy", "momentum"]
    model = st.load(model_folder(2, None, contacts=["tail"], functions=functions))
    check_landing(model, st.export(model, "fmu", tmp_path / "tail.fmu"))


def test_event_indicators_are_heights_and_the_start_is_clear(fmu, opened):
    path, model = fmu("ground"), zoo.model("ground")
    unit, references, _ = opened(path, "Model")
    described, count = fmpy.read_model_description(str(path)), sum(model.contacts.values())
    assert described.numberOfEventIndicators == count
    heights = np.zeros(count)
    place = heights.ctypes.data_as(fmpy.fmi2.POINTER(fmpy.fmi2.c_double))
    unit.getEventIndicators(place, count)
    assert (heights > 0).all()
    run = landing(model)
    put(unit, references, start_values(model, run))
    unit.getEventIndicators(place, count)
    points, _ = model.contact_points(run.q[0], run.v[0], LEGS)
    np.testing.assert_allclose(heights, points[:, 2], atol=1e-12)
    # it has no directional derivatives
    assert not described.modelExchange.providesDirectionalDerivative
    with pytest.raises(fmpy.fmi1.FMICallException):
        unit.getDirectionalDerivative([0], [0], [1.0])

"""What is wrong with arguments and data is told by name; where markers are on the body,
against the model's own tail points and SciPy's rotations; derivatives against differences; and
inverse dynamics against the torques that made the motion.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.identification import radau_steps as radau
from serpentail.identification.inverse import smoothed
from serpentail.identification.linear import marker_jacobians
from serpentail.identification.placement import placements, world_points
from serpentail.identification.start import turned
from serpentail.identification.unknowns import unknowns
from tests.identification.flights import flown, placed, start, tracks
from tests.support import zoo
from tests.support.rows import row

TIMES = np.linspace(0, 0.1, 21)


@pytest.fixture(scope="module")
def flight():
    model = zoo.model("m1_n3")
    return model, flown(model, TIMES, start(model))


def test_arguments_are_refused(flight):
    model, states = flight
    data = tracks(model, TIMES, states, 1e-4)
    short = np.linspace(0, 0.05, 2)
    for words, change in {
        "estimate: value 'tail_mas'.*'tail_mass'": {"estimate": ["tail_mas"]},
        "estimate: value 3": {"estimate": [3]},
        "estimate: marker:nos: .*'nose'": {"estimate": ["marker:nos"]},
        r"torso_inertia\[3\]: there are entries 0 to 2": {"estimate": ["torso_inertia[3]"]},
        r"torso_inertia\[same\]: value": {"estimate": ["torso_inertia[same]"]},
        r"tail_mount\[1\] is named twice": {"estimate": ["tail_mount", "tail_mount[1]"]},
        "estimate: value 'tail_mass'": {"estimate": "tail_mass"},
        "estimate.tail_mass: value -1": {"estimate": {"tail_mass": -1.0}},
        "noise.nose: value 0": {"noise": 0.0},
        "noise.left: value 2": {"noise": dict.fromkeys(placed(model), 2) | {"nose": 1e-3}},
        "noise: no value for 'left'": {"noise": {"nose": 1e-3}},
        "confidence: value 1": {"confidence": 1.0},
        "confidence: value 0": {"confidence": 0.0},
        "torques: value .* 2 numbers": {"torques": [1.0, 2.0, 3.0]},
        "torques.std: value 0": {"torques": st.TorquePrior(0.0, 0.1)},
        "torques.time: value 0": {"torques": st.TorquePrior(0.1, 0.0)},
        "torques: known from 0 to 0.05 s": {"torques": (short, np.zeros((2, 2)))},
        "torques: known from 0.05 to": {"torques": (short + 0.05, np.zeros((2, 2)))},
        r"torques: times have shape \(2,\)": {"torques": (short, np.zeros((2, 3)))},
        "torques: times have .* increase": {"torques": (short[::-1], np.zeros((2, 2)))},
        r"torques\(0.* has shape \(3,\)": {"torques": lambda _t: np.zeros(3)},
        "torques: 2 entries: needs one of 1": {"torques": [None, None]},
        "markers: value {}": {"markers": {}},
        "markers.nose: value .*torso=": {"markers": {"nose": st.Marker()}},
        "markers.nose.tail: value 1.5": {"markers": {"nose": st.Marker(tail=1.5)}},
        "markers.nose.torso: value": {"markers": {"nose": st.Marker(torso=(1, 2))}},
        "markers of arrays: value 'ear'": {"markers": {"ear": st.Marker(tail=0.5)}},
        "data: none": {"data": []},
        "wild: no such setting": {"wild": 1},
    }.items():
        arguments = {"data": data, "markers": placed(model), "estimate": ["tail_mass"]} | change
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.identify(model, **arguments)


def test_models_that_cannot_be_identified_are_refused():
    data = st.marker_tracks(np.arange(5.0), np.ones((5, 1, 3)), ["a"], unit="m")
    for name, names, error, words in (
        ("bare", [], st.ModelError, "without 'forward_dynamics_derivatives'"),
        ("polar", [], st.ModelError, "polar"),
        ("single", [], st.ModelError, "float"),
        ("baked", ["tail_mass"], st.IdentificationError, "baked"),
        ("fixed", [], st.ModelError, "fixed"),
        ("tree", [], st.ModelError, "tail alone"),
        (None, [], st.IdentificationError, "model: value 3"),
    ):
        with row(name), pytest.raises(error, match=words):
            st.identify(zoo.model(name) if name else 3, data, {"a": st.Marker(tail=1)}, names)
    for words, given, cutoff in (
        ("cutoff: value 0", data, 0),
        ("tracks: type str", "x.trc", 10),
        ("too few markers", data, 10),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.joint_torques(zoo.model("m1_n3"), given, {"a": st.Marker(tail=1)}, cutoff=cutoff)
    wrong = (("fixed", "fixed"), ("polar", "polar"), ("single", "float"), ("tree", "tail alone"))
    for name, words in wrong:
        with row(name), pytest.raises(st.ModelError, match=words):
            st.joint_torques(zoo.model(name), data, {"a": st.Marker(tail=1)}, cutoff=10)


def test_too_few_markers_are_refused(flight):
    """Two, three on a line, and those that tell too little of the tail under unknown torques."""
    model, states = flight
    data = tracks(model, TIMES, states, 1e-2)
    two = {name: placed(model)[name] for name in ("nose", "tail3")}
    with pytest.raises(st.IdentificationError, match=r"too few markers: .* at most 2 at once"):
        st.identify(model, data, two)
    names, places = [*"abc"], data.positions[:, :1] + np.arange(3)[:, None]
    line = st.marker_tracks(TIMES, places, names, unit="m")
    with pytest.raises(st.IdentificationError, match="at most 3 at once, on a line"):
        st.identify(model, line, dict.fromkeys(names, st.Marker(torso=(0, 0, 0))))
    torso = {name: placed(model)[name] for name in ("nose", "left", "right")}
    data = tracks(model, TIMES[:8], states[:8])
    prior = st.TorquePrior(0.5, 0.02)
    assert st.identify(model, data, torso, torques=prior, noise=1e-5).success
    with pytest.raises(st.IdentificationError, match="do not determine tail coordinate"):
        st.identify(model, data, torso, torques=prior, noise=3e-5)


MODELS = ("m2_n2", "arcs2", "own_links", "mixed")  # the last two on a tilted mount
PLACES, OFFSET = (0.0, 0.1, 0.37, 0.5, 0.75, 1.0), (0.001, -0.002, 0.003)


def shapes(model, count=5):
    """Configurations of any attitude, with tails bent by up to a radian a coordinate."""
    q = np.random.default_rng(3).normal(size=(count, model.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[-1, 7:] = 0.0
    return q


def chained(model, q, along):
    """A marker in the world by a chain of rotations; arcs are integrals of their direction."""
    p, pairs = model.parameters, q[7:].reshape(-1, 2)
    own = {"articulated": list(p.get("link_lengths", ())), "continuum": [*p.get("arc_lengths", ())]}
    equal = p["tail_length"] / np.sum(model.joints_each)
    x, weight = np.polynomial.legendre.leggauss(30)
    turn = Rotation.from_quat(q[[4, 5, 6, 3]])
    place, left = q[:3] + turn.apply(p["tail_mount"]), along * p["tail_length"]
    pitch, roll, yaw = p.get("mount_angles", (0, 0, 0))
    turn = turn * Rotation.from_euler("ZXY", [yaw, pitch, roll])
    for kind, count, (a, b) in zip(model.kinds, model.joints_each, pairs, strict=True):
        for _ in range(count):
            length = own[kind].pop(0) if own[kind] else equal
            part = min(left, length)
            if kind == "continuum":
                bend = np.array([a, 0, b]) * part / length
                slices = turn * Rotation.from_rotvec(np.outer((x + 1) / 2, bend))
                place = place + weight / 2 @ slices.apply([0, -part, 0])
                turn = turn * Rotation.from_rotvec(bend)
            else:
                turn = turn * Rotation.from_euler("XZ", [a, b])
                place = place + turn.apply([0, -part, 0])
            left -= part
            if left < 1e-12:
                return place + turn.apply(OFFSET)
    raise AssertionError(left)


def test_markers_are_where_a_chain_of_rotations_ends():
    markers = {f"p{s}": st.Marker(tail=s, offset=OFFSET) for s in PLACES}
    for name in (*MODELS, "polar"):
        model = zoo.model(name)
        q = shapes(model)
        if name == "polar":  # a = -theta cos(phi), b = theta sin(phi)
            q[:, 8] = np.abs(q[:, 8]) + 0.1
        found, bent = st.marker_positions(model, q, markers), q.copy()
        if name == "polar":
            bent[:, 7:] = np.stack([-q[:, 8] * np.cos(q[:, 7]), q[:, 8] * np.sin(q[:, 7])], axis=1)
        wanted = [[chained(model, each, along) for along in PLACES] for each in bent]
        np.testing.assert_allclose(found, wanted, atol=1e-14, err_msg=name)


def test_derivatives_of_markers_are_central_differences():
    h = 1e-4
    markers = {f"p{s}": st.Marker(tail=s, offset=OFFSET) for s in (0.1, 0.6, 1.0)}
    markers["torso"] = st.Marker(torso=(0.01, 0.02, 0.03))
    for name in MODELS:
        model = zoo.model(name)
        q, places = shapes(model), placements(model, markers)
        lengths = [each for each in ("link_lengths", "arc_lengths") if each in model.parameters]
        wanted = [*(lengths or ["tail_length"]), "tail_mount", "marker:p0.6", "torso_mass"]
        wanted += ["mount_angles"] * ("mount_angles" in model.parameters)
        unknown = unknowns(places, wanted)
        by_q, by = marker_jacobians(unknown, places, q)

        def at(values, unknown=unknown, q=q):
            return world_points(unknown.placed_at(values), q)

        steps = h * np.eye(len(unknown.start))
        slopes = [(at(unknown.start + x) - at(unknown.start - x)) / (2 * h) for x in steps]
        np.testing.assert_allclose(by, np.stack(slopes, axis=-1), atol=1e-8, err_msg=name)
        points = [
            world_points(places, turned(model, q, np.tile(sign * x, (len(q), 1))))
            for x in h * np.eye(model.nv)
            for sign in (1, -1)
        ]
        slopes = (np.array(points[::2]) - points[1::2]) / (2 * h)
        np.testing.assert_allclose(by_q, np.moveaxis(slopes, 0, -1), atol=1e-8, err_msg=name)


def interval(model, x, torques, span=0.004):
    nodes = radau.NODES[:, None]
    over = ((1 - nodes) * torques[0] + nodes * torques[1])[None]
    one = radau.Intervals(np.array([span]), x[None], over)
    return radau.solved(model, one, np.tile(x, (1, 3, 1)))[0], one


@pytest.mark.parametrize("name", ["m1_n3", "elastic", "arcs2", "elastic_arcs"])
def test_intervals_end_as_by_scipy_and_their_derivatives_are_central_differences(name):
    model = zoo.model(name)
    x, nt = start(model), model.layout.nt
    torques, span = 1e-3 * np.random.default_rng(0).standard_normal((2, nt)), 0.001
    flight = flown(model, np.array([0, span]), x, lambda t: [1 - t / span, t / span] @ torques)
    ours = interval(model, x, torques, span)[0][-1]
    assert np.abs(radau.difference(model, ours, flight[-1])).max() < 1e-7 or name == "elastic_arcs"
    X, one = interval(model, x, torques)
    by_struct = np.eye(len(model.parameter_vector))
    found = radau.differentiated(model, one, X[None], by_struct, unknown_torques=True)

    def change(h, end_at):
        ahead, behind = (interval(*end_at(sign * h))[0][-1] for sign in (1, -1))
        return radau.difference(model, ahead, behind) / (2 * h)

    for k, unit in enumerate(np.eye(2 * model.nv)):
        wanted = change(1e-6, lambda h, u=unit: (model, radau.moved(model, x, h * u), torques))
        np.testing.assert_allclose(found.by_state[0, :, k], wanted, atol=2e-6, rtol=2e-6)
    for unit in np.eye(2 * nt).reshape(-1, 2, nt):
        wanted = change(1e-5, lambda h, u=unit: (model, x, torques + h * u))
        (end,), (k,) = unit.any(axis=1).nonzero(), unit.any(axis=0).nonzero()
        own = found.by_torque[0, end[0], :, k[0]]
        np.testing.assert_allclose(own, wanted, atol=1e-6 * np.abs(wanted).max())
    for of, column in (("torso_mass", 1), ("tail_mount", 5)):
        value = np.array(model.parameters[of], float)
        unit = np.eye(3)[0] if value.ndim else 1.0

        def other(h, of=of, value=value, unit=unit):
            return model.with_parameters(**{of: value + h * unit}), x, torques

        wanted = change(1e-6 * max(np.abs(value).max(), 1e-3), other)
        own = found.by_parameters[0, :, column]
        np.testing.assert_allclose(own, wanted, atol=1e-5 * np.abs(wanted).max() + 1e-9)


INNER = slice(20, -20)  # frames away from the ends


def test_the_smoother_passes_what_its_formula_says():
    """Amplitude 1 / (1 + (f / cutoff)^6), without delay; ends are left out."""
    cutoff, times, shares = 10.0, np.linspace(0, 1.5, 601), np.array([0.5, 1.0, 2.0])
    rate = 2 * np.pi * shares * cutoff
    sine, cosine = np.sin(times[:, None] * rate), np.cos(times[:, None] * rate)
    gain, middle = 1 / (1 + shares**6), slice(200, 400)
    wanted = gain * sine, gain * cosine, -gain * sine
    for order, found in enumerate(smoothed(times, sine, cutoff)):
        off = (found / rate**order - wanted[order])[middle]
        assert np.abs(off).max() < [2e-3, 3e-3, 4e-3][order], order

    # uneven times with gaps are smoothed alike
    times = np.sort(np.random.default_rng(0).uniform(0, 2, 400))
    times[150:] += 0.03
    value, first, _ = smoothed(times, np.sin(5 * times)[:, None], 20.0)
    np.testing.assert_allclose(value[INNER, 0], np.sin(5 * times)[INNER], atol=1e-4)
    np.testing.assert_allclose(first[INNER, 0], 5 * np.cos(5 * times)[INNER], atol=5e-3)


def test_torques_power_and_the_residual_wrench_are_those_of_the_flight():
    """A push on the torso is the wrench: the reference flies with another weight, too."""
    model, times = zoo.model("m1_n3"), np.linspace(0, 0.4, 201)
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]

    def torque(t):
        return 1e-3 * np.array([np.sin(30 * t), np.cos(20 * t)])

    wanted = np.array([torque(t) for t in times])
    for gravity in (9.8, 4.9):
        states = flown(model.with_parameters(gravity=gravity), times, start(model), torque)
        found = st.joint_torques(model, tracks(model, times, states), placed(model), cutoff=80.0)
        push = found.residual_force[INNER] - [0, 0, (9.8 - gravity) * mass]
        assert np.abs(push).max() < 0.01, gravity
        if gravity == 9.8:
            off, rates = (found.tau - wanted)[INNER], states[:, -2:]
            np.testing.assert_allclose(off, 0, atol=3e-5)
            off = (found.power - wanted * rates)[INNER]
            np.testing.assert_allclose(off, 0, atol=3e-5 * np.abs(rates).max())
            assert np.abs(found.residual_moment[INNER]).max() < 1e-4

"""No touch is missed, however short and however loose the tolerance: grazing tails, feet and
torsos, against where free flights come to lie below the ground.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation.ground import GroundSettings
from tests.support import zoo
from tests.support.rows import row

SPAN = 0.12  # s
CLOCK = 1e-4  # s between the samples of the free flights that tell the truth
LEGS = st.Legs.fixed(np.radians(210), np.radians(-15))
PASSIVE = st.Damping(1e-3)
ADAPTIVE = ("ros34pw2", "tsit5", "switching")
METHODS = [
    *({"method": m, "rtol": r} for m in ADAPTIVE for r in (1e-3, 1e-4, 1e-6)),
    {"method": "rk4"},
    {"method": "implicit_euler"},
]
NAMES = ["-".join(map(str, how.values())) for how in METHODS]
TAILS = {"links": "ground_m2_n2", "arcs": "ground_arcs", "legs": ""}
QUICK, EULERS = 20, 6e-3  # starts; s, an error of its times
FREE = {"controller": None, "t_span": 0.3}


@cache
def animal(tail="links"):
    if tail != "legs":
        return zoo.model(TAILS[tail])
    rat = st.build("rat_legs", contacts=["hind"], targets=["c"])
    return rat.with_parameters(gravity=1.0)  # legs rise again before they fall


def flown(model, q, v, **how):
    ways = {"legs": LEGS, "controller": PASSIVE} if "feet" in model.contacts else {}
    return st.simulate(model, q, v, **{"t_span": SPAN} | ways | how)


@cache
def grazes(tail, count):
    """Starts (count, nq), (count, nv) that soon dip 0.1 to 5 mm into the ground, and when."""
    rng, model, many = np.random.default_rng(5), animal(tail), 8 * count
    q, v = np.zeros((many, model.nq)), np.zeros((many, model.nv))
    attitude, axis = rng.normal(size=(many, 4)), rng.normal(size=(many, 3))
    q[:, 3:7] = attitude / np.linalg.norm(attitude, axis=1)[:, None]
    q[:, 7:] = rng.uniform(-0.3, 0.3, (many, model.nq - 7))
    turning = axis / np.linalg.norm(axis, axis=1)[:, None] * rng.uniform(10, 30, (many, 1))
    v[:, :3], v[:, 3:6] = 0.3 * rng.normal(size=(many, 3)), turning
    # far above the ground, then lowered: a flight does not know its height
    q[:, 2] = 10
    found, coarse = [], flown(model, q, v, output_step=1e-3, rtol=1e-5)
    for k, depth in enumerate(10 ** rng.uniform(-4, np.log10(5e-3), many)):
        if not 2 < lowest_of(coarse[k]).argmin() < 118 or len(found) == count:
            continue
        fine = flown(model, q[k], v[k], output_step=CLOCK, method="tsit5", rtol=1e-9)
        height = lowest_of(fine)
        q[k, 2] -= height.min() + depth
        if height[0] > height.min() + depth + 1e-3:
            found.append((q[k], v[k], fine.t[np.argmax(height < height.min() + depth)]))
    assert len(found) == count
    return [np.array(each) for each in zip(*found, strict=True)]


def lowest_of(run):
    """Heights (K,) of the lowest point."""
    return run.contact.points[..., 2].min(axis=1)


def missed(tail, count, how):
    """Return the starts whose first touch is no event near its time, or is not felt where the run's
    own samples lie in the ground; implicit Euler's paths are of order 1, and may stay above it.
    """
    late = EULERS if how["method"] == "implicit_euler" else 3e-3
    q, v, times = grazes(tail, count)
    runs, misses = flown(animal(tail), q, v, output_step=5e-4, **how), []
    for run, time in zip(runs, times, strict=True):
        downs = [event["time"] for event in run.events if event["kind"] == "touch_down"]
        pushed = sum(np.abs(each[2]) for each in map(np.array, run.info["impulse_N_s"].values()))
        felt = pushed > 0 or run.contact.depth.max() < 1e-5
        above = late == EULERS and lowest_of(run).min() > 1e-4  # far more than it dips in a sample
        if (min((abs(down - time) for down in downs), default=1) > late and not above) or not felt:
            misses.append((time, downs))
    return misses


@pytest.mark.parametrize("count", [QUICK, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("how", METHODS, ids=NAMES)
def test_no_grazing_touch_is_missed(how, count):
    for tail in TAILS:
        with row(tail):
            assert missed(tail, count, how) == []


@cache
def shallow(count):
    """Free flights (count, nq), (count, nv) whose lowest point in the air comes to lie up to 3 mm
    in the ground, and when they first touch (s), by runs at rtol 1e-11.
    """
    rng, model, many = np.random.default_rng(5), animal(), 3 * count
    q, v = np.zeros((many, model.nq)), np.zeros((many, model.nv))
    attitude, axis = rng.normal(size=(many, 4)), rng.normal(size=(many, 3))
    q[:, 3:7] = attitude / np.linalg.norm(attitude, axis=1)[:, None]
    q[:, 2], q[:, 7:] = 10, rng.uniform(-0.3, 0.3, (many, model.nq - 7))
    v[:, :3] = 0.3 * rng.normal(size=(many, 3)) + [0, 0, 1.47]
    v[:, 3:6] = axis / np.linalg.norm(axis, axis=1)[:, None] * rng.uniform(10, 30, (many, 1))
    free = flown(model, q, v, output_step=1e-3, rtol=1e-5, **FREE)
    depths = 10 ** rng.uniform(-5, -2.5, many)
    for k, depth in enumerate(depths):
        height = lowest_of(free[k])
        # the last minimum that is lower than all before
        before = np.minimum.accumulate(height)[5:-6]
        lows = np.flatnonzero((height[6:-5] < before) & (height[6:-5] < height[7:-4]))
        deep = depth + height[lows[-1] + 6] if len(lows) else 0
        q[k, 2] -= deep if height[0] > deep + 1e-3 else 0
    exact = {
        "method": "tsit5",
        "rtol": 1e-11,
        "stop_at": [("touch_down", g) for g in model.contacts],
    }
    ends = flown(model, q, v, output_step=0.3, **FREE, **exact).ends
    found = np.flatnonzero(ends < 0.29)[:count]
    assert len(found) == count
    return q[found], v[found], ends[found]


@pytest.mark.parametrize("count", [60, pytest.param(400, marks=pytest.mark.slow)])
def test_a_touch_that_a_tolerance_misses_is_named(count):
    """The run passes above it, closer than it knows its height; nothing is said far above."""
    (q, v, times), far, missed = shallow(count), np.eye(11)[2], {}
    for rtol in 10.0 ** -np.arange(2, 9, 1 if count > 60 else 2):
        for method in ADAPTIVE if count > 60 else ("switching",):
            how = {"output_step": 0.3, "method": method, "rtol": rtol} | FREE
            missed[rtol] = 0
            with row(method, rtol):
                for run, time in zip(flown(animal(), q, v, **how), times, strict=True):
                    first = min((event["time"] for event in run.events), default=np.inf)
                    if first > time + max(1e-2, 5 * rtol):  # later, heights off by mm touch, too
                        missed[rtol] += 1
                        near = run.info["near"]
                        assert 0 < near["height"] < near["error"] < 200 * rtol
                        told = f"{near['group']}: point {near['point']} passed "
                        assert any(told in each for each in run.warnings)
                above = flown(animal(), q[:60] + far, v[:60], **how)
                assert not any("near" in run.info for run in above)
    assert missed[1e-2] > 0.1 * count and missed[1e-8] == 0


def test_a_touch_is_named_where_its_point_sinks_twice_in_a_step():
    """The run passes 0.2 um above what is 1.9 mm deep, which only parts of the step show."""
    q, v = np.zeros(11), np.zeros(10)
    q[2:5], v[2:4] = (0.23199, 0.8575, -0.5144), (1.13, -15.4)
    q[3:5] /= np.linalg.norm(q[3:5])
    loose = {"rtol": 1e-2, "output_step": 0.3, "method": "switching"}
    run, exact = (flown(animal(), q, v, **how, **FREE) for how in (loose, {"rtol": 1e-9}))
    assert exact.events[0]["group"] == run.info["near"]["group"] == "tail"
    assert run.events == [] and 0 < run.info["near"]["height"] < 1e-5
    assert run.info["near"]["time"] == pytest.approx(exact.events[0]["time"], abs=1e-3)


def test_the_height_of_a_near_pass_is_the_lowest_of_the_run():
    q, v, _ = (each[25:36] for each in shallow(60))
    runs = flown(animal(), q, v, output_step=3e-5, rtol=1e-2, method="switching", **FREE)
    runs = [run for run in runs if "near" in run.info and not run.events]
    told = [run.info["near"]["height"] - lowest_of(run).min() for run in runs]
    assert len(told) > 1 and np.abs(told).max() < 1e-6


def test_auto_flies_by_tsit5_and_touches_by_ros34pw2():
    """Far above the ground it takes the steps of tsit5; alone as among many."""
    model, (q, v, _) = animal(), shallow(60)
    how = {"rtol": 1e-4, "output_step": 0.01, **FREE}
    free, by_tsit5 = (
        flown(model, q[0] + np.eye(11)[2], v[0], method=m, **how) for m in ("auto", "tsit5")
    )
    np.testing.assert_array_equal(free.q, by_tsit5.q)
    assert free.info["method"] == "switching" and free.info["factorisations"] == 0
    runs = flown(model, q[:8], v[:8], **how)
    for k in range(8):
        alone = flown(model, q[k], v[k], **how)
        np.testing.assert_array_equal(runs[k].q, alone.q)
    touched = [k for k in range(8) if runs[k].info["factorisations"]]
    assert len(touched) > 4 and all(runs[k].events for k in touched)


def test_a_tail_that_dips_in_between_stages_is_felt():
    """2 ms in the ground: two events, the impulse of exact steps, and few steps that are taken
    again: of a quarter of the dip.
    """
    q, v = np.zeros(11), np.zeros(10)
    q[2:5] = 0.245467, -0.455276, 0.890351
    v[2:4] = 0.27784, -29.6167
    exact = flown(animal(), q, v, method="tsit5", rtol=1e-9)
    impulse = exact.info["impulse_N_s"]["tail"][2]
    assert impulse > 1e-3
    for rtol, most in ((1e-3, 17), (1e-4, 20), (1e-5, 27), (1e-6, 27)):
        with row(rtol):
            run = flown(animal(), q, v, rtol=rtol)
            touched = [(event["group"], event["kind"]) for event in run.events]
            assert touched == [("tail", "touch_down"), ("tail", "take_off")]
            assert run.events[0]["time"] == pytest.approx(exact.events[0]["time"], abs=2e-4)
            assert run.info["impulse_N_s"]["tail"][2] == pytest.approx(impulse, rel=0.15)
            assert run.warnings == [] and run.info["rejected"] <= most


def test_a_force_that_comes_again_in_the_ground_is_no_new_touch():
    """A group takes off where its force ceases for the last time before it is out of the ground."""
    ground = GroundSettings({"feet": 6, "tail": 3})
    down, off, clear = 0, 1, 4  # of the feet, as C numbers them
    times, numbers = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [down, off, down, off, clear, down]
    kinds = [(event["time"], event["kind"]) for event in ground.events(times, numbers)]
    assert kinds == [(1.0, "touch_down"), (4.0, "take_off"), (6.0, "touch_down")]


def test_methods_that_look_for_no_events_say_so():
    q, v = (each[0] for each in grazes("links", QUICK)[:2])
    for method in ("dop853", "lsoda"):
        with pytest.raises(st.SimulationError, match=f"stop_at: {method}"):
            flown(animal(), q, v, method=method, stop_at=[("touch_down", "tail")])
        run = flown(animal(), q, v, method=method, rtol=1e-6, atol=1e-6)
        with pytest.raises(ValueError, match=f"events: {method}"):
            _ = run.events


def test_a_step_that_turns_too_far_is_taken_shorter_or_refused():
    """No bound holds for a step that turns the torso by more than 2 rad."""
    q, v = np.zeros(11), np.zeros(10)
    q[2:4], v[5] = (5, 1), 300.0
    run = flown(animal(), q, v, method="tsit5", rtol=1e-2)
    assert run.info["steps"] * 2 > 300 * SPAN
    with pytest.raises(st.SimulationError, match="turns the torso too far"):
        flown(animal(), q, v, method="implicit_euler", step=0.02, output_step=0.06)


@pytest.mark.parametrize("how", [{"method": "implicit_euler", "step": 5e-3}, {"rtol": 1e-4}])
def test_a_run_stops_at_the_first_of_events_that_almost_coincide(how):
    model, pitch = animal(), np.linspace(-0.4, 0.4, 81)
    q, v = np.zeros((81, model.nq)), np.zeros((81, model.nv))
    q[:, 2], q[:, 3], q[:, 4], v[:, 2] = 0.1, np.cos(pitch / 2), np.sin(pitch / 2), -1.5
    whole = flown(model, q, v, **how)
    stopped = flown(model, q, v, stop_at=[("touch_down", g) for g in model.contacts], **how)
    first_of = set()
    for run, end in zip(whole, stopped.ends, strict=True):
        downs = [(e["time"], e["group"]) for e in run.events if e["kind"] == "touch_down"]
        (time, group), (after, other), *_ = sorted(downs)
        assert end == pytest.approx(time, abs=1e-9)
        if after - time < 1e-3:
            first_of.add((group, other))
    assert first_of >= {("torso", "tail"), ("tail", "torso"), ("torso", "feet")}

"""A run from another start is, when it is asked for again, what it is the first time."""

import gc
import multiprocessing
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import waiting
from tests.support import zoo
from tests.support.rows import row

FIELDS = ("t", "q", "v", "tau", "energy", "linear_momentum", "angular_momentum")
TIMES = {"seconds", "cpu_seconds"}


def first_of(state, name="m1_n3", **how):
    """The run of a model for which none waits."""
    return st.simulate(zoo.own(name), *state, **how)


def start(k=0, nq=9):
    rng = np.random.default_rng(k)
    return np.array([0, 0, 1.0, *rng.normal(size=nq - 3)]), rng.normal(size=nq - 1)


def waits(model):
    return waiting._waiting.get(model, {})


def assert_same(one, other):
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    if one.contact is not None:
        for name in ("bristles", "forces"):
            arrays = (getattr(motion.contact, name) for motion in (one, other))
            np.testing.assert_array_equal(*arrays, err_msg=name)
    infos = ({k: v for k, v in each.info.items() if k not in TIMES} for each in (one, other))
    assert next(infos) == next(infos)


HOW = [
    {},
    {"method": "tsit5", "rtol": 1e-4, "output_step": 0.1},
    {"method": "ros34pw2", "most_steps": 1000},
    {"method": "rk4", "step": 1e-3},
    {"step": np.float64(1e-3)},
]


def above_ground(k):
    rng, q = np.random.default_rng(k), np.array([0, 0, 0.05, 1.0, 0, 0, 0, 0, 0])
    q[4:] = 0.1 * rng.normal(size=5)
    return q, 0.3 * rng.normal(size=8)


def check_first(name, starts, **how):
    """What starts give one after another is what each gives of a model for which no run waits."""
    model = zoo.own(name)
    found = [st.simulate(model, *each, **how) for each in starts]
    assert len(waits(model)) == 1 and not np.shares_memory(found[0].q, found[1].q)
    for each, motion in zip(starts, found, strict=True):  # after all have run
        with row(how, each):
            assert_same(motion, first_of(each, name, **how))
    return found


@pytest.mark.parametrize(("name", "nq"), [("m1_n3", 9), ("single", 11)])
def test_bit_for_bit_what_it_is_the_first_time(name, nq):
    each = tuple(np.linspace(1e-3, 2e-3, nq - 7).tolist())
    for controller in (None, st.Damping(1e-3), st.Damping(each)):
        for how in HOW:
            acting = {"controller": controller, "t_span": (0.1, 0.3)} | how
            check_first(name, [start(k, nq) for k in range(3)], **acting)


LEGS = st.Legs.fixed(np.radians(210), np.radians(-15))


def test_the_same_on_the_ground():
    acting = {"legs": LEGS, "controller": st.Damping(1e-3), "t_span": 0.2}
    for how in ({}, {"method": "tsit5", "rtol": 1e-4}, {"step": 1e-3}):
        found = check_first("feet_tail", [above_ground(k) for k in range(3)], **acting | how)
        assert any(motion.events for motion in found)


def test_on_the_ground_what_differs_is_made_anew():
    model, (q, v) = zoo.own("feet_tail"), above_ground(0)
    how = {"controller": st.Damping(1e-3), "t_span": 0.05}
    st.simulate(model, q, v, legs=LEGS, **how)
    deep = np.array([*q[:2], -0.1, *q[3:]])
    with pytest.raises(st.SimulationError, match="mm deep at the start"):
        st.simulate(model, deep, v, legs=LEGS, **how)
    for other in (
        {"legs": st.Legs.fixed(3.5, -0.2)},
        {"legs": LEGS, "bristles0": np.full((9, 2), 1e-4)},
        {"legs": LEGS, "stop_at": [("touch_down", "feet")]},
    ):
        again = st.simulate(model, q, v, **how, **other)
        assert_same(again, first_of((q, v), "feet_tail", **how, **other))
    with pytest.raises(st.SimulationError, match="this model has feet"):
        st.simulate(model, q, v, **how)


def test_auto_chooses_for_each_start():
    model, decays = zoo.own("m1_n3"), []
    stretched, bent = (np.array([0, 0, 1, 1, 0, 0, 0, a, 0]) for a in (0, 1.2))
    for q in (stretched, bent):
        how = {"t_span": 0.01, "controller": st.Damping(1e-3)}
        motion = st.simulate(model, q, np.zeros(8), **how)
        decays.append(motion.info["reason"])
        assert_same(motion, first_of((q, np.zeros(8)), **how))
    assert decays[0] != decays[1]
    # just stiff for one of the starts
    rates = [float(words.split()[-2]) for words in decays]
    law = st.Damping(1e-3 * 3e3 / np.sqrt(np.prod(rates)))
    how, each = {"t_span": 1e-3, "controller": law, "rtol": 1e-4}, (stretched, bent, stretched)
    found = [st.simulate(model, q, np.zeros(8), **how).info["method"] for q in each]
    assert sorted({*found}) == ["ros34pw2", "tsit5"] and found[0] == found[2]


WRONG = [
    ({"q0": [1.0]}, "q0 has shape"),
    ({"q0": np.full(9, np.nan)}, r"q0\[0\]: value nan"),
    ({"v0": np.full(8, np.inf)}, r"v0\[0\]: value inf"),
    ({"q0": np.zeros(9)}, "zero quaternion"),
    ({"controller": st.Damping(True)}, "damping: value True"),
    ({"controller": st.Damping(-1.0)}, "damping: value -1.0"),
    ({"t_span": True}, "t_span"),
    ({"rtol": True}, "rtol: value True"),
    ({"most": 3}, "'most'"),
    ({"threads": 2}, "threads: value 2"),
    ({"watch": 1}, "watch: value 1"),
    ({"legs": 3}, "no contacts"),
    ({"method": "euler"}, "method: value 'euler'"),
]


def test_refused_as_the_first_time():
    model, (q0, v0) = zoo.own("m1_n3"), start()
    sound = {"q0": q0, "v0": v0, "controller": st.Damping(1.0), "t_span": 1.0, "rtol": 1.0}
    sound["method"] = "ros34pw2"
    for wrong, words in WRONG:
        st.simulate(model, **sound)
        for twice in range(2):
            with row(words, twice):
                with pytest.raises(st.SerpentailError, match=words):
                    st.simulate(model, **sound | wrong)
                assert len(waits(model)) == 1


def test_only_what_is_plain_and_came_to_its_end_waits():
    model = zoo.own("m1_n3")
    table = st.TorqueTable([0, 1], np.ones((2, 2)))
    for how in (
        {"controller": lambda t, q, v: [0, 0]},
        {"controller": table},
        {"t_span": [0.0, 0.1]},
        {"watch": lambda part: None},
        {"method": "dop853"},
    ):
        st.simulate(model, *start(), **{"t_span": 0.1} | how)
        assert not waits(model), how
    with pytest.raises(st.SimulationError, match="most_steps"):
        st.simulate(model, *start(), t_span=0.1, most_steps=1)
    assert not waits(model)


def test_few_wait_and_none_keeps_its_model_alive():
    model = zoo.own("m1_n3")
    for k in range(1, 12):
        st.simulate(model, *start(), t_span=k / 100)
    assert len(waits(model)) == waiting.MOST_RUNS
    st.simulate(model, *start(), t_span=1e-3, output_step=1e-3 / waiting.MOST_SAMPLES)
    assert all(run.start.intervals < waiting.MOST_SAMPLES for run in waits(model).values())
    gc.collect()
    gc.disable()
    try:
        twin = model.with_parameters(gravity=1.0)
        st.simulate(twin, *start(), t_span=0.1)
        gone = weakref.ref(twin)
        del twin
        assert gone() is None
    finally:
        gc.enable()


def test_threads_share_no_run():
    model = zoo.own("m1_n3")
    alone = [first_of(start(k), t_span=0.2) for k in range(4)]

    def fly(k):
        for _ in range(30):
            motion = st.simulate(model, *start(k), t_span=0.2)
            np.testing.assert_array_equal(motion.q, alone[k].q)
            np.testing.assert_array_equal(motion.v, alone[k].v)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(fly, range(4)))
    assert len(waits(model)) == 1


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="needs fork")
def test_a_child_makes_its_own():
    model = zoo.own("m1_n3")
    first = st.simulate(model, *start(0), t_span=0.2)
    ours, theirs = multiprocessing.get_context("fork").Pipe()

    def fly():
        theirs.send(st.simulate(model, *start(1), t_span=0.2).q)

    child = multiprocessing.get_context("fork").Process(target=fly)
    child.start()
    mine = st.simulate(model, *start(0), t_span=0.2)
    assert ours.poll(60)
    found = ours.recv()
    child.join()
    assert_same(mine, first)
    np.testing.assert_array_equal(found, first_of(start(1), t_span=0.2).q)

"""Rows of sweeps are what the runs themselves return, however and wherever they are made."""

import tracemalloc
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest

import serpentail as st
from serpentail.bridges.sweeps import driver
from serpentail.bridges.sweeps.places import Place
from serpentail.bridges.sweeps.result import Status
from serpentail.bridges.sweeps.store import Row
from serpentail.bridges.sweeps.sweep import posed
from tests.support import swept, zoo
from tests.support.rows import row as named

Q0 = [0, 0, 0.34, 1, 0, 0, 0, 0.2, 0]
LOW, HIGH = [0, 0, 1, -9, -9, -9, 0, 0], [0, 0, 2, 9, 9, 9, 0, 0]
SETTINGS = {"q0": Q0, "t_span": 0.05, "controller": st.Damping(1e-3)}


def model():
    return zoo.model("m1_n1")


def flights(count, own=None, **settings):
    axes = {"tail_mass": st.grid([0.003, 0.005]), "v0": st.sobol(LOW, HIGH)}
    return st.sweep(own or model(), axes, points=count, settings=SETTINGS, **settings)


def close(row, motion):
    assert row["error"] is None and row["end_s"] == motion.t[-1]
    for name, array in (("q_end", motion.q), ("v_end", motion.v)):
        np.testing.assert_allclose(row[name], array[-1], rtol=0, atol=1e-9)
    energies = row["kinetic_end_J"] + row["potential_end_J"]
    assert energies == pytest.approx(motion.energy[-1], abs=1e-12)


def test_rows_are_those_of_single_runs():
    found = flights(8)
    assert len(found) == 16 and found.spent.points == 16
    for k in (0, 7, 15):
        row = found[k]
        own = model().with_parameters(tail_mass=row["tail_mass"])
        close(row, st.simulate(own, Q0, row["v0"], t_span=0.05, controller=st.Damping(1e-3)))
        np.testing.assert_array_equal(found.motion(k).v[0], row["v0"])
    assert [row["tail_mass"] for row in found.rows()] == [0.003] * 8 + [0.005] * 8
    assert {row["number"] for row in found.rows()} == set(range(16))


def test_all_executors_make_the_same_rows():
    wanted = [row["q_end"] for row in flights(2).rows()]
    with ThreadPoolExecutor(1) as threads, ProcessPoolExecutor(1, get_context("spawn")) as pool:
        for executor in (threads, pool, "processes:2"):
            found = [row["q_end"] for row in flights(2, executor=executor).rows()]
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


class Broken(ThreadPoolExecutor):
    """Loses the blocks that it gets."""

    def submit(self, *_):
        gone = Future()
        gone.set_exception(BrokenExecutor("the worker has died"))
        return gone


def test_an_executor_that_is_gone_is_named(monkeypatch):
    """When its workers are lost, when it takes no more work, and when it does not answer."""

    def squares(executor):
        return st.sweep(None, {"x": st.grid([3])}, swept.square, executor=executor, limit=60)

    with Broken(1) as executor, pytest.raises(st.SweepError, match="the worker has died"):
        squares(executor)
    with pytest.raises(st.SweepError, match=r"its workers are gone.*after shutdown"):
        with ThreadPoolExecutor(1) as executor:
            pass
        squares(executor)

    def lost():
        raise ConnectionResetError("reset by the scheduler")

    place = Place(executor.submit, lost)
    monkeypatch.setattr(driver, "place_of", lambda _: nullcontext(place))
    with pytest.raises(st.SweepError, match=r"are gone.*reset by the scheduler"):
        squares(None)


def test_a_second_call_runs_what_is_missing_only(tmp_path):
    store = tmp_path / "rows"
    first = flights(2, store=store)
    again = flights(2, store=store)
    assert again.spent.points == 0 and again.rows() == first.rows()
    more = flights(4, store=store)  # Sobol's first points stay
    assert more.spent.points == 4 and more.status() == Status(8, 8, 0)
    assert [more[k] | {"number": 0} for k in (0, 5)] == [first[k] | {"number": 0} for k in (0, 3)]
    assert flights(2, model().with_parameters(torso_mass=0.2), store=store).spent.points == 4


def test_other_grids_orders_and_numbers_of_points_keep_the_rows_they_have(worker, tmp_path):
    """A Latin hypercube of another number of points has other points."""
    give = partial(st.sweep, None, run=swept.numbers, store=tmp_path / "rows", executor=worker)
    a, b, pair = st.grid([1, 2]), st.random(0, 1), st.grid([(1, "x"), (2, "y")])
    for over, points, made in (
        ({"a": a, "c,d": pair, "b": b}, 3, 12),
        ({"c, d": pair, "a": st.grid([3, 2]), "b": b}, 4, 16 - 2 * 3),
        ({"a": st.grid([1, 2, 3]), "c,d": pair, "b": b}, 2, 0),
        ({"a": a, "c,d": pair, "b": st.random(0, 2)}, 2, 8),
        ({"a": a, "b": st.latin(0, 1)}, 4, 8),
        ({"a": a, "b": st.latin(0, 1)}, 3, 6),
    ):
        found = give(over, points=points)
        with named((list(over), points)):
            assert found.spent.points == made
            for k, row in enumerate(found):
                assert row["number"] == k and row["told"] == [row["a"], row.get("d"), row["b"]]
    assert give({"a": a, "b": b}, points=4, seed=1).spent.points == 8


def test_failures_are_rows_and_can_be_run_again(tmp_path):
    axes = {"tail_mass": st.grid([0.003, -1.0]), "v0": st.random(LOW, HIGH)}
    given = {"points": 4, "settings": SETTINGS, "store": tmp_path / "rows"}
    found = st.sweep(model(), axes, **given)
    assert found.status() == Status(8, 8, 4)
    assert str(found.status()) == "8 of 8 points done, 4 of them failed, 0 left"
    assert "tail_mass: value -1" in found[5]["error"] and "q_end" not in found[5]
    close(found[1], found.motion(1))
    assert st.sweep(model(), axes, **given).spent.points == 0
    assert st.sweep(model(), axes, **given, retry_failed=True).spent.points == 4


def test_functions_are_run_with_and_without_a_model_and_tell_progress(worker, tmp_path):
    """What their rows depend on is part of their keys."""
    given = {"store": tmp_path / "s", "executor": worker}
    for of, points in (("1", 2), ("1", 0), ("2", 2)):
        found = st.sweep(None, {"x": st.grid([3, 4])}, swept.square, of=of, **given)
        assert found.spent.points == points
        assert [row["square"] for row in found.rows()] == [9, 16]
    with pytest.raises(st.SweepError, match="returned no motion"):
        found.motion(0)
    told = []
    with st.progress(told.append):
        st.sweep(None, {"x": st.grid(range(40))}, swept.square, executor=worker)
    told = [each for each in told if each.stage == "sweep"]
    assert told[-1].ended and any("of 40" in each.what for each in told)
    assert any(each.left is not None for each in told[:-1])
    axes = {"tail_mass": st.grid([0.002]), "span": st.grid([0.1, 0.2])}
    found = st.sweep(model(), axes, swept.fly, executor=worker)
    for row in found.rows():
        assert row["mass"] == 0.002 and "motion" not in row
        # the centre of mass falls so, and the torso, whose tail is light, nearly so
        assert row["fallen"] == pytest.approx(9.81 * row["span"] ** 2 / 2, rel=0.1)
    page = found.view(1, tmp_path / "page.html")
    assert page.read_text(encoding="utf-8").startswith("<!")


def test_plans_are_rows(worker):
    settings = {"q0": Q0, "v0": [0, 0, 1, 2, 0, 0, 0, 0], "goal": st.Goal(torso_rate=None)}
    settings |= {"solver": st.Solver(track=False), "tolerances": st.Tolerances(attitude=None)}
    settings["mesh"] = st.Mesh(rounds=0)
    axes = {"duration": st.grid([0.4, 0.5]), "intervals": st.grid([4])}  # a field of a mesh
    found = st.sweep(model(), axes, "plan", settings=settings, executor=worker)
    assert [row["duration_s"] for row in found.rows()] == [0.4, 0.5]
    assert {row["intervals"] for row in found.rows()} == {4}
    assert all(row["error"] is None and "success" in row for row in found.rows())


def test_what_cannot_be_is_refused_in_one_line():
    usual = {"model": model(), "over": {"tail_mass": st.grid([0.003])}, "run": "simulate"}
    usual |= {"settings": SETTINGS | {"v0": LOW}}
    for name, value in {"run": "fly", "settings": 3, "limit": 0, "executor": "slurm"}.items():
        with named(name), pytest.raises(st.SweepError, match=f"{name}: value {value!r}"):
            st.sweep(**usual | {name: value})
    for words, changes in {
        "run: value .*simulate": {"run": lambda point: {}, "settings": None},
        "settings: no v0: ": {"settings": {"q0": Q0}},
        "settings: watch": {"settings": {"watch": print}},
        "settings: watch: ": {"settings": {"solver": st.Solver(watch=print)}, "run": "plan"},
        "settings: q0: value .*nan": {"settings": {"q0": float("nan")}},
        "outputs: value 'height'": {"outputs": ["height"]},
        "outputs: value 'end_s'": {"outputs": "end_s"},
        r"outputs: value \[\]": {"outputs": []},
        r"outputs: value \['end_s'\]": {"outputs": ["end_s"], "run": "plan"},
        "executor: processes: value 0": {"executor": "processes:0"},
        "over: segments: ": {"over": {"segments": st.grid([1, 2])}},
        "point 1 occurs twice": {"over": {"tail_mass": st.grid([0.003, 0.003])}},
        "over: tail_mass: value '3 s'": {"over": {"tail_mass": st.grid(["3 s"])}},
        "settings: no data and no markers": {"run": "identify"},
        "model: None": {"model": None},
        "no_such_scene": {"model": "no_such_scene"},
        "of: value": {"of": {1, 2}},
        "settings: a function": {"run": swept.square, "settings": {"rtol": 1}},
        r"over: v0: values are of shape \(\): needs 8": {"over": {"v0": st.grid([1.0])}},
        "over: q0: values are not numbers: needs 9": {"over": {"q0": st.grid(["up"])}},
    }.items():
        with named(words), pytest.raises(st.SweepError, match=words) as caught:
            st.sweep(**usual | changes)
        assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_exports_and_iteration_hold_few_rows(tmp_path):
    pytest.importorskip("pyarrow")
    count = 20_000
    found = posed(None, {"x": st.grid(range(count))}, swept.square, tmp_path / "rows")
    with found.store.writing():
        for first in range(0, count, 10_000):
            told = [
                Row(k, f'{{"square": {k * k}}}', None, 0.1) for k in range(first, first + 10**4)
            ]
            found.store.accept(told)
    found.save(tmp_path / "rows.parquet")  # imports what it needs before memory counts
    for name in ("rows.csv", "rows.parquet", None):
        tracemalloc.start()
        try:
            if name:
                found.save(tmp_path / name)
            else:
                assert sum(row["square"] == row["x"] ** 2 for row in found) == count
            assert tracemalloc.get_traced_memory()[1] < 5.5e6  # all rows have 8 MB
        finally:
            tracemalloc.stop()

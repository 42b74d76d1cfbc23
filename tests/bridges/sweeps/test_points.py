"""Points of sweeps: grids, points that fill what they are spread in, and how many a block has."""

import math
import tracemalloc

import numpy as np
import pytest
from scipy.stats import kstest

import serpentail as st
from serpentail.bridges.sweeps.driver import Group
from serpentail.bridges.sweeps.points import axes_of
from tests.support.rows import row as named


def test_points_need_no_list():
    over = {"a": st.grid(range(2500)), "b": st.latin([0] * 3, [1] * 3), "c": st.latin(1, 2)}
    tracemalloc.start()
    try:
        found = axes_of(over, 4000, 0).at([9_999_999, 3, 4_000_003, 5_000_000])  # of 10 million
        assert tracemalloc.get_traced_memory()[1] < 2e6
    finally:
        tracemalloc.stop()
    assert [x["a"] for x in found] == [2499, 0, 1000, 1250]
    assert found[1]["b"] == found[2]["b"] != found[3]["b"]


def points(over, count=None, seed=0):
    return list(axes_of(over, count, seed))


def test_grids_give_all_combinations_in_order():
    over = {"a": st.grid([1, 2]), ("b", "c"): st.grid([(3, "x"), (4, "y")])}
    wanted = [(1, 3, "x"), (1, 4, "y"), (2, 3, "x"), (2, 4, "y")]
    assert points(over) == [dict(zip("abc", values, strict=True)) for values in wanted]
    assert len(axes_of(over, None, 0)) == 4
    assert points({"b, c": st.grid([(3, 4)])}) == [{"b": 3, "c": 4}]


def test_units_become_those_of_the_names_that_have_one():
    axes = axes_of({"m, word": st.grid([("2 g", "2nd"), (0.1, "3 s")])}, None, 0)
    found = [{"m": 0.002, "word": "2nd"}, {"m": 0.1, "word": "3 s"}]
    assert list(axes.measured({"m": "kg"})) == found
    spread = axes_of({"m": st.random("2 g", "3 g")}, 4, 0)
    for unit in ("kg", None):
        assert all(0.002 <= p["m"] <= 0.003 for p in spread.measured({"m": unit}))
    for wrong in ({"word": "s"}, {"word": None}):
        with pytest.raises(st.SweepError, match="over: word: value '2nd'"):
            axes.measured(wrong)
    with pytest.raises(st.SweepError, match="over: m: value '2 g': a mass where a length"):
        spread.measured({"m": "m"})


def test_points_are_uniform_and_the_same_again():
    for name, way in {"random": st.random, "latin": st.latin, "sobol": st.sobol}.items():
        over = {"a": way([0, 10], [1, 30]), "b": way(1e-3, 1e3, "log"), "c": st.grid([1, 2])}
        found = points(over, 256, 3)
        with named(name):
            assert len(found) == 512 and found == points(over, 256, 3) != points(over, 256, 4)
            # the points that are spread are the same at each place of the grid
            assert [{**p, "c": 0} for p in found[:256]] == [{**p, "c": 0} for p in found[256:]]
            columns = [
                [p["a"][0] for p in found[:256]],
                [(p["a"][1] - 10) / 20 for p in found[:256]],
                [(math.log10(p["b"]) + 3) / 6 for p in found[:256]],
            ]
            for column in columns:
                assert kstest(column, "uniform").pvalue > 1e-3
                if name != "random":  # each of 256 equal parts has one point
                    assert sorted(int(256 * x) for x in column) == list(range(256))
            assert abs(np.corrcoef(columns) - np.eye(3)).max() < 0.2
    for count in (1, 2, 5):  # Sobol's points may be any number
        assert len(points({"a": st.sobol(0, 1)}, count)) == count


def test_points_that_cannot_be_are_refused_in_one_line():
    one = {"a": st.random(0, 1)}
    for words, make in {
        "grid: value 3": lambda: st.grid(3),
        "grid: value 'ab'": lambda: st.grid("ab"),
        "grid: no values": lambda: st.grid([]),
        "grid: value nan": lambda: st.grid([float("nan")]),
        "random: low: value '2 apples'": lambda: st.random("2 apples", 3),
        "random: low: value 1": lambda: st.random(1, 0),
        "random: low: value 0: .*above 0": lambda: st.random(0, 1, "log"),
        "latin: law: value 'normal'": lambda: st.latin(0, 1, "normal"),
        r"low is \(2,\), high is \(\)": lambda: st.sobol([0, 0], 1),
        "over: value {}": lambda: points({}),
        "over: value 3": lambda: points({3: st.grid([1])}),
        r"over\['a'\]: value 3": lambda: points({"a": 3}),
        r"over\['a, b'\]: value": lambda: points({"a, b": st.random(0, 1)}, 3),
        "over: a, b: value 1: needs 2": lambda: points({("a", "b"): st.grid([1])}),
        "'a' twice": lambda: points({"a": st.grid([1]), ("a",): st.grid([2])}),
        "'b' twice": lambda: points({"a, b": st.grid([[1, 2]]), "b": st.grid([2])}),
        "latin and random": lambda: points(one | {"b": st.latin(0, 1)}, 3),
        "points: value None": lambda: points(one),
        "points: value 3": lambda: points({"a": st.grid([1])}, 3),
        "points: value 0": lambda: points(one, 0),
        "seed: value -1": lambda: points(one, 3, -1),
        "points: value 1000000000": lambda: points(one, 10**9),
    }.items():
        with named(words), pytest.raises(st.SweepError, match=words) as caught:
            make()
        assert "\n" not in str(caught.value)


def test_blocks_have_a_second_or_more_and_share_what_is_left():
    for (pace, largest, left, workers), wanted in {
        (0.0, 0, 9999, 4): 1,
        (0.01, 1, 9999, 4): 8,  # grows
        (0.01, 1000, 9999, 4): 100,  # a second
        (0.01, 1000, 30, 4): 25,  # of the end: a quarter of a second, and not all for one worker
        (0.01, 1000, 10**6, 300): 1000,  # 10 s
        (0.01, 10**5, 10**8, 10**4): 3333,  # a minute at most
        (1e-9, 10**5, 10**6, 4): 50_000,
        (300.0, 1, 9, 4): 1,
    }.items():
        with named((pace, largest, left, workers)):
            group = Group(None, np.broadcast_to(7, left), pace, largest)
            assert len(group.take(workers)) == wanted and len(group.left) == left - wanted

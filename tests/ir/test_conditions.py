"""Conditions: what they run, and what they become where a tape cannot tell."""

import random
from fractions import Fraction

import numpy as np
import pytest

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.cost import branches
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.passes.batch import batched
from serpentail_codegen.targets.c.loops import in_loops
from serpentail_codegen.targets.target import UnprintableStatement
from tests.support.algebras import RATIONAL
from tests.support.program_runs import unrolled_values
from tests.support.programs import step_of
from tests.support.rows import row

COUNT = step_of(
    "count", (("x", 1), ("y", 1)), (("z", 1),), lambda t, x, y: [t.add(t.mul(x, y), t.const(1))]
)


def conditional():
    """Conditions in a loop and in each other: what is written under one is read, summed up and
    overwritten after it.
    """
    b = Builder("choosy", "Conditions.")
    x, y, u = b.array("x", 1, 4, "input"), b.array("y", 1, 4, "input"), b.array("u", 1, 4, "output")
    w, t = b.array("w", 1, role="output"), b.array("t", 1)
    b.fill(w[0], 1)
    with b.loop("i", 4) as i:
        b.fill(u[i], 7)
        with b.when(x[i]):
            b.apply(COUNT, {"x": x[i], "y": y[i]}, z=t[0])
            b.apply(COUNT, {"x": t[0], "y": w[0]}, z_=w[0])
            with b.when(y[i]):
                b.copy(u[i], t[0])
                b.copy(w[0], y[i], adds=True)
        with b.when(w[0]), b.loop("j", i + 1) as j:
            b.copy(u[j], x[i], adds=True)
    return b.finish()


def plainly(x, y):
    """The same in Python."""
    u, w = [], 1
    for i, (a, b) in enumerate(zip(x, y, strict=True)):
        u.append(7)
        if a > 0:
            t = a * b + 1
            w += t * w + 1
            if b > 0:
                u[i], w = t, w + b
        if w > 0:
            u = [value + a for value in u]
    return u, w


def test_conditions_run_what_they_ask_for_and_unroll_to_choices():
    p = conditional()
    for seed in range(20):
        rng = random.Random(seed)
        given = {
            name: [Fraction(rng.randint(-3, 3), rng.randint(1, 2)) for _ in range(4)]
            for name in "xy"
        }
        values = Run(p, RATIONAL, given).values
        with row(seed):
            assert (values["u"], values["w"][0]) == plainly(given["x"], given["y"])
            found = {"u": values["u"], "w": values["w"]}
            assert unrolled_values(p, given, RATIONAL) == found
            assert unrolled_values(p, given, RATIONAL, fixed=["x", "y"]) == found


def test_each_lane_runs_what_its_own_conditions_ask_for():
    rng, lanes = np.random.default_rng(0), 40
    many = {name: list(rng.integers(-3, 4, (4, lanes)).astype(float)) for name in "xy"}
    p = batched(conditional(), lanes)
    assert {a.name: a.lanes for a in p.arrays}["w"] == lanes  # at first 1 in all of them
    values = Run(p, Numbers(np), many).values
    for k in range(lanes):
        u, w = plainly(*([float(values[k]) for values in many[name]] for name in "xy"))
        found = [np.broadcast_to(scalar, lanes)[k] for scalar in (*values["u"], values["w"][0])]
        with row(k):
            assert found == [*u, w]


def test_a_number_under_a_condition_of_lanes_has_lanes():
    b = Builder("counts", "A number of its own under a condition.")
    x, u = b.array("x", 1, role="input"), b.array("u", 1, role="output")
    t, one = b.array("t", 1), b.constant("one", [1])
    b.fill(t[0], 0)
    with b.when(x[0]):
        b.copy(t[0], one[0])
    b.copy(u[0], t[0])
    p = batched(b.finish(), 3)
    assert {a.name: a.lanes for a in p.arrays}["t"] == 3
    (u,) = Run(p, Numbers(np), {"x": [np.array([1.0, -1.0, 2.0])]}).values["u"]
    assert list(u) == [1, 0, 1]


def test_what_cannot_be_done_in_some_lanes_alone_is_refused():
    records = {
        "Fill": lambda b, u: b.fill(u[0], 1),
        "Guard": lambda b, u: b.guard(u[0], "OUT_OF_RANGE", u[0]),
    }
    for kind, record in records.items():
        b = Builder("partly", "A statement under a condition.")
        x, u = b.array("x", 1, role="input"), b.array("u", 1, role="output")
        b.copy(u[0], x[0])
        with b.when(x[0]):
            record(b, u)
        with row(kind), pytest.raises(UnprintableStatement, match=f"cannot print {kind}"):
            in_loops(batched(b.finish(), 8), "double", "rat")
    with pytest.raises(ValueError, match="a guard under a condition"):
        unroll(b.finish())


def test_a_condition_survives_being_called():
    b, p = Builder("outer", "Calls."), conditional()
    given = {a.name: b.array(a.name, 1, a.count, a.role) for a in p.arrays if a.role != "local"}
    b.call(p, **given)
    p, given = b.finish(), {"x": [1, -1, 2, 0], "y": [1, 2, -3, 4]}
    assert branches(p) and not branches(assemble(FUNCTIONS["mass_matrix"], Tail(1, 1)))
    values = Run(p, RATIONAL, given).values
    assert (values["u"], values["w"][0]) == plainly(**given)

"""Gradients of rates and margins, and the transposed implicit solve, against CasADi's derivatives,
against differences, and against the solve itself.
"""

import casadi as ca
import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import function_of
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.pipeline import tail_of
from tests.mechanics.test_contact import near_ground
from tests.support import zoo
from tests.support.rows import row

NAMES = ["taped", "taped_m2_n2"]


def states(name, count=8):
    """States near the ground, without and with points in it."""
    model = zoo.model(name)
    return model, [list(each) for each in zip(*near_ground(model, 2, count), strict=True)]


def sides(model, q, v, bristles, legs):
    return model.kernel("margins")(q, v, bristles, legs)[:, 1:]


def turns(q):
    """How a unit quaternion moves with a turn in body axes (4, 3)."""
    w, x, y, z = q[3:7]
    return np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]) / 2


@pytest.mark.parametrize("name", NAMES)
def test_gradients_of_rates_are_those_of_casadi(name):
    model, given = states(name)
    call = model.casadi.symbolic("contact_dynamics")
    inputs = [ca.SX.sym(f"x{k}", call.size1_in(k)) for k in range(call.n_in())]
    weights = ca.SX.sym("w", model.nv + 2 * sum(model.contacts.values()))
    found = call(*inputs)
    total = ca.dot(weights, ca.vertcat(found[0], ca.vec(found[1])))
    gradients = ca.Function("g", [*inputs, weights], [ca.gradient(total, x) for x in inputs])
    touched, rng = 0, np.random.default_rng(1)
    for q, v, tau, bristles, legs in given:
        w = rng.normal(size=weights.numel())
        branches = sides(model, q, v, bristles, legs)
        ours = model.kernel("rates_vjp")(q, v, tau, bristles, legs, branches, w)
        unit = q / np.r_[np.ones(3), np.full(4, np.linalg.norm(q[3:7])), np.ones(model.nq - 7)]
        theirs = gradients(unit, v, tau, bristles, legs, model.parameter_vector, w)
        by_q, *others = (np.asarray(each).ravel() for each in theirs)
        by_q = np.r_[by_q[:3], turns(unit).T @ by_q[3:7], by_q[7:]]
        touched += (model.contact_points(q, v, legs)[0][:, 2] < 0).sum()
        first = 0
        for part in (by_q, *others):
            with row(first, part.size):
                mine, most = ours[first : first + part.size], np.abs(part).max()
                np.testing.assert_allclose(mine, part, rtol=0, atol=1e-11 * most + 1e-12)
            first += part.size
        assert first == ours.size
        change = rng.normal(size=first)
        along = w @ model.kernel("rates_jvp")(q, v, tau, bristles, legs, branches, change)
        np.testing.assert_allclose(along, change @ ours, rtol=1e-10)
    assert touched


@pytest.mark.parametrize("name", NAMES)
def test_gradients_of_margins_are_their_differences(name):
    model, given = states(name, 3)
    rng = np.random.default_rng(0)
    for q, v, _, bristles, legs in given:
        w = rng.normal(size=(sum(model.contacts.values()), 3))
        dq, dv, du, dl = (rng.normal(size=n) for n in (model.nv, model.nv, bristles.size, 8))

        def total(e, at=(q, v, bristles, legs), by=(dq, dv, du, dl), w=w):
            moved = [x + e * change for x, change in zip(at[1:], by[1:], strict=True)]
            return (w * model.kernel("margins")(model.integrate(at[0], by[0], e), *moved)).sum()

        slopes = [(total(e) - total(-e)) / (2 * e) for e in (1e-5, 5e-6)]
        direction = np.concatenate([dq, dv, np.zeros(model.layout.nt), du, dl])
        found = model.kernel("margins_vjp")(q, v, bristles, legs, w)[: direction.size] @ direction
        np.testing.assert_allclose(found, (4 * slopes[1] - slopes[0]) / 3, rtol=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_the_transposed_solve_is_the_transpose(name):
    model, given = states(name)
    rng = np.random.default_rng(0)
    for q, v, _, bristles, legs in given:
        state = (q, v, np.full(model.layout.nt, 1e-3), np.zeros(2), [1e-4, 1.0], bristles, legs)
        factors = model.kernel("implicit_factor")(*state)
        sizes = (model.nv, model.nv, bristles.size)
        r, k = ([rng.normal(size=size) for size in sizes] for _ in range(2))
        solved = np.concatenate(model.kernel("implicit_solve")(factors, *r))
        turned = np.concatenate(model.kernel("implicit_solve_transposed")(factors, *k))
        one, other = np.concatenate(k) * solved, turned * np.concatenate(r)
        assert abs(one.sum() - other.sum()) < 1e-13 * np.abs(one).sum()


def test_the_transposed_solve_of_a_flight():
    """Without contacts the system is symmetric: its programs are run as they are."""
    scene = zoo.scene("m1_n3")
    tail, rng = tail_of(scene), np.random.default_rng(0)
    programs = [
        assemble(function_of(name, tail), tail)
        for name in ("implicit_solve", "implicit_solve_transposed")
    ]
    factors = rng.uniform(0.5, 1.5, tail.factors)
    factors[-3:-1] = 0  # no gains
    given = {name: [*rng.normal(size=tail.nv)] for name in ("r_q", "r_v", "k_q", "k_v")}
    found = [Run(p, Numbers(), given | {"factors": [*factors]}).values for p in programs]
    one = sum(np.dot(given[f"k_{part}"], found[0][f"k_{part}"]) for part in "qv")
    other = sum(np.dot(given[f"r_{part}"], found[1][f"r_{part}"]) for part in "qv")
    np.testing.assert_allclose(one, other, rtol=1e-12)

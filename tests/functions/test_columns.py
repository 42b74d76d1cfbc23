"""Sweeps in lanes and eliminations written out: they mean what the plain programs mean."""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.ir.ldl import ldl_factor, ldl_solve
from serpentail_codegen.ir.program import Factor, Solve, padded, statements
from serpentail_codegen.passes.unrolled_ldl import unrolled_ldl
from tests.references.parameters import random_states
from tests.support.models import model_folder

SIZES = [(1, 1), (1, 3), (2, 1), (2, 3), (4, 2), (7, 1)]


def arguments(program, seed=0):
    """Random arguments of a program, its parameters positive."""
    rng = np.random.default_rng(seed)
    given = {a.name: rng.uniform(0.1, 1, a.length).tolist() for a in program.of_role("parameters")}
    return given | {a.name: rng.normal(size=a.length).tolist() for a in program.of_role("input")}


def outputs(program, given):
    """All outputs of a run, as flat arrays by name."""
    values = Run(program, Numbers(np), given).values
    return {a.name: np.array(values[a.name], float) for a in program.of_role("output")}


def assert_same_acceleration(size, name, dynamics):
    """Other dynamics are another program, and mean what H column by column means."""
    plain, other = (
        assemble(FUNCTIONS[name], Tail(*size), each) for each in ("composite", dynamics)
    )
    assert plain != other
    given = arguments(plain)
    expected, found = outputs(plain, given)["v_dot"], outputs(other, given)["v_dot"]
    assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["forward_dynamics", "forward_dynamics_external"])
def test_sweeps_in_lanes_give_the_same_acceleration(size, name):
    assert_same_acceleration(size, name, "lanes")


@pytest.mark.parametrize("rows", [1, 2, 5, 9, 12])
@pytest.mark.parametrize("wide", [0, 3])
def test_an_elimination_written_out_solves(rows, wide):
    rng = np.random.default_rng(rows)
    half = rng.normal(size=(rows, rows))
    matrix, b = half @ half.T + rows * np.eye(rows), rng.normal(size=(rows, wide or 1))
    d = Builder("solve", "Solve.")
    A, given = d.array("A", padded(rows), rows), d.array("given", padded(rows), rows, role="input")
    x = d.wide("x", rows, wide) if wide else d.array("x", rows)
    right, out = (
        d.array("b", rows, role="input"),
        d.array("out", rows * max(wide, 1), role="output"),
    )
    d.copy(A.part(0, A.length), given.part(0, given.length))
    if wide:
        rights = [d.array(f"b{k}", rows, role="input") for k in range(wide)]
        at = d.wide("at", wide, wide)
        d.unit(at.part(0, wide), 0)
        spread = _spread(rows, wide)
        d.apply(
            spread,
            {f"b{k}": rights[k][0] for k in range(wide)}
            | {f"at{k}": at.part(k, 1) for k in range(wide)},
            x=x[0],
        )
    else:
        d.copy(x[0], right[0])
    d.factor(A, rows)
    d.solve(A, x[0])
    for k in range(rows):
        for lane in range(max(wide, 1)):
            d.copy(out.part(k * max(wide, 1) + lane, 1), x.lane(k, lane) if wide else x.part(k, 1))
    whole = d.finish()
    flat = np.zeros((rows, padded(rows)))
    flat[:, :rows] = matrix
    values = {"given": flat.ravel().tolist(), "b": b[:, 0].tolist()} | {
        f"b{k}": b[:, k].tolist() for k in range(wide)
    }
    straight = unrolled_ldl(whole, 12)
    assert not any(isinstance(s, Factor | Solve) for s, _ in statements(straight.body))
    for p in (whole, straight):
        np.testing.assert_allclose(
            outputs(p, values)["out"].reshape(rows, -1), np.linalg.solve(matrix, b), rtol=1e-11
        )
    assert outputs(whole, values)["out"].tolist() == outputs(straight, values)["out"].tolist()
    values["given"][0] = -1.0
    assert min(float(np.min(x)) for _, x in Run(straight, Numbers(np), values).guards) < 0


def _spread(rows, wide):
    """The step that puts columns into lanes."""
    from serpentail_codegen.ir.step import Step
    from serpentail_codegen.ir.tape import Tape

    tape, results = Tape(), []
    columns = [[tape.input(c * rows + k) for k in range(rows)] for c in range(wide)]
    at = [tape.input(wide * rows + c) for c in range(wide)]
    for k in range(rows):
        total = tape.const(0)
        for c in range(wide):
            total = tape.add(total, tape.mul(at[c], columns[c][k]))
        results.append(total)
    inputs = (*((f"b{c}", rows) for c in range(wide)), *((f"at{c}", 1) for c in range(wide)))
    return Step("spread", "Spread.", inputs, (("x", rows),), tuple(tape.nodes), tuple(results))


def test_matrices_beyond_the_limit_keep_their_loops():
    long = assemble(FUNCTIONS["forward_dynamics"], Tail(7, 1), "lanes")
    assert unrolled_ldl(long, 12) == long


def test_factor_and_solve_invert():
    rng = np.random.default_rng(1)
    half = rng.normal(size=(6, 6))
    matrix, b = half @ half.T + np.eye(6), rng.normal(size=6)
    factored, pivots = ldl_factor(Numbers(np), [list(matrix[k, : k + 1]) for k in range(6)])
    np.testing.assert_allclose(
        ldl_solve(Numbers(np), factored, list(b)), np.linalg.solve(matrix, b), rtol=1e-10
    )
    assert np.prod(np.array(pivots)) == pytest.approx(np.linalg.det(matrix), rel=1e-10)


@pytest.mark.parametrize("size", [(2, 4), (3, 4), pytest.param((7, 3), marks=pytest.mark.slow)])
def test_long_tails_run_in_lanes_and_agree_with_loops(size):
    names = ["forward_dynamics", "mass_matrix", "bias_force"]
    fast, plain = (
        st.load(model_folder(*size, functions=names, emission=e)) for e in ("lanes", "loops")
    )
    text = (fast.folder / "src" / f"{fast.name}.c").read_text()
    assert (
        "gather_lanes" in text
        and "gather_lanes" not in (plain.folder / "src" / f"{plain.name}.c").read_text()
    )
    for q, v, *_ in zip(*random_states(size[0], 1, 5, "random"), strict=True):
        tau = 0.01 * v[6:]
        H, found = plain.mass_matrix(q), fast.forward_dynamics(q, v, tau)
        force = np.concatenate([np.zeros(6), tau]) - plain.bias_force(q, v)
        scale = np.sqrt(np.diag(H))
        bound = 5e-15 * np.linalg.cond(H / np.outer(scale, scale))
        expected = plain.forward_dynamics(q, v, tau)
        assert np.abs(found - expected).max() <= 20 * bound * np.abs(expected).max()
        assert np.abs(H @ found - force).max() <= 1e-9 * np.abs(force).max()


def test_the_fast_form_serves_derivatives_too():
    tail = Tail(3, 4)
    name = "forward_dynamics_derivatives"
    plain, lanes = (
        assemble(CATALOGUE[name], tail, dynamics) for dynamics in ("composite", "lanes")
    )
    given = arguments(plain)
    expected, found = outputs(plain, given), outputs(lanes, given)
    for key, value in expected.items():
        assert np.abs(found[key] - value).max() <= 1e-9 * np.abs(value).max()

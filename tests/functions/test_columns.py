"""Sweeps in lanes and by segments, and eliminations written out: they mean what the plain programs
mean, and are chosen where they are faster.
"""

from dataclasses import replace

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.cost import CountingRun
from serpentail_codegen.ir.dataflow import inlined
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.ir.program import Factor, Solve, statements
from serpentail_codegen.passes.unrolled_ldl import unrolled_ldl
from serpentail_codegen.scene.variant import EQUAL, Shape
from serpentail_codegen.targets.c.form import RULE, fastest
from tests.support import zoo
from tests.support.rows import row

FUNCTION = "forward_dynamics"
LONG = [Tail(m, 3, "continuum") for m in (8, 16, 24)]
SIZES = [(1, 1), (1, 3), (2, 1), (2, 3), (4, 2), (7, 1), (9, 1)]


def arguments(program, seed=0):
    """Random arguments of a program, its parameters positive."""
    rng = np.random.default_rng(seed)
    given = {a.name: rng.uniform(0.1, 1, a.length).tolist() for a in program.of_role("parameters")}
    return given | {a.name: rng.normal(size=a.length).tolist() for a in program.of_role("input")}


def outputs(program, given):
    """All outputs of a run, as flat arrays by name."""
    values = Run(program, Numbers(np), given).values
    return {a.name: np.array(values[a.name], float) for a in program.of_role("output")}


def assert_same(name, tail, form, limit):
    """A form is another program, and means what H column by column means."""
    plain, other = (assemble(CATALOGUE[name], tail, each) for each in ("composite", form))
    assert plain != other
    given = arguments(plain)
    if tail.contacts:
        given["q"][2] = 0.02
    found = outputs(other, given)
    for key, expected in outputs(plain, given).items():
        with row(name, tail, key):
            assert np.abs(expected).max() > 0
            assert np.abs(found[key] - expected).max() <= limit * np.abs(expected).max()


@pytest.mark.parametrize("form", ["lanes", "segments"])
def test_other_forms_give_the_same(form):
    for size in SIZES:
        for name in (FUNCTION, "forward_dynamics_external"):
            assert_same(name, Tail(*size), form, 1e-12)
    assert_same("forward_dynamics_derivatives", Tail(3, 4), form, 1e-9)
    assert_same("contact_dynamics", Tail(3, 2, contacts=("tail", "torso")), form, 1e-10)


def test_derivatives_by_segments_are_those_of_long_segments_too():
    assert_same("forward_dynamics_derivatives", Tail(1, 96), "segments", 1e-11)


def test_arcs_and_mixed_tails_go_by_segments():
    """With all that a tail can have: own segments, a tilted mount, stops, contacts."""
    kinds = ("articulated", "continuum", "continuum", "articulated", "continuum")
    own = Shape((2, 5, 5, 3, 5), kinds, links=5, arcs=3, tilted=True)
    passive = ("spring", "damping", "stops")
    for size, shape in (((9, 3, "continuum"), EQUAL), ((5, 5, "mixed"), own)):
        tail = Tail(*size, shape=shape, passive=passive)
        assert_same(FUNCTION, tail, "segments", 1e-11)
        assert_same("forward_dynamics_derivatives", tail, "segments", 1e-10)
        ground = replace(tail, contacts=("tail", "torso"))
        assert_same("contact_dynamics", ground, "segments", 1e-10)


def test_work_by_segments_grows_with_their_number():
    counts = [operations(assemble(CATALOGUE[FUNCTION], tail, "segments")) for tail in LONG]
    assert counts[2] - counts[1] == counts[1] - counts[0]


def operations(program):
    """Additions, multiplications and divisions of a run."""
    given = (*program.of_role("parameters"), *program.of_role("input"))
    return CountingRun(program, {a.name: [a.lanes] * a.length for a in given}).counter.count


def test_functions_without_a_form_have_another():
    """What needs the matrix goes in lanes, and arcs have no lanes."""
    for name in ("forward_dynamics_jvp", "mass_matrix", "pfl"):
        segments, lanes = (assemble(CATALOGUE[name], Tail(3, 2), x) for x in ("segments", "lanes"))
        assert segments == lanes, name
    arcs = Tail(3, 2, "continuum")
    for name in (FUNCTION, "mass_matrix"):
        assert assemble(CATALOGUE[name], arcs, "lanes") == assemble(CATALOGUE[name], arcs), name


def signs(segments, **changed):
    """Which pivots are positive: two of each segment from the last on, then six of the torso."""
    found = Run(segments, Numbers(np), arguments(segments) | changed).guards
    assert [status for status, _ in found] == ["NOT_POSITIVE_DEFINITE"] * 12
    return [value > 0 for _, value in found]


def test_every_pivot_is_guarded():
    segments = assemble(CATALOGUE[FUNCTION], Tail(3, 2), "segments")
    assert all(signs(segments))
    heavy = signs(segments, torso_mass=[-1e3])
    assert heavy[:6] == [True] * 6 and not all(heavy)
    assert signs(segments, tail_mass=[-1.0], link_inertia=[-1.0] * 3)[:2] == [False] * 2


def test_forms_are_chosen_where_they_are_faster():
    table = {
        "straight": [(1, 9), (3, 2), (4, 1)],
        "lanes": [(1, 10), (1, 96), (2, 15), (3, 4), (4, 3), (7, 1)],
        "segments": [(2, 16), (4, 4), (8, 1)],
    }
    for form, sizes in table.items():
        for size in sizes:
            with row(form, size):
                assert fastest(CATALOGUE[FUNCTION], Tail(*size))[0] == form
    assert {2 * m * m * n for m, n in table["segments"]} == {RULE["segments_from"]}
    for arcs, form in ((1, "straight"), (3, "straight"), (4, "segments")):
        assert fastest(CATALOGUE[FUNCTION], Tail(arcs, 5, "continuum"))[0] == form, arcs
    for size, form in (((1, 64), "lanes"), ((3, 4), "lanes"), ((4, 4), "segments")):
        assert fastest(CATALOGUE["forward_dynamics_derivatives"], Tail(*size))[0] == form, size
    assert fastest(CATALOGUE["mass_matrix"], Tail(1, 96))[0] == "loops"


def test_the_manifest_tells_forms_and_the_rule_that_chose_them():
    for name in ("m1_n3", "m3_n4", "loops", "segments"):
        manifest, auto = zoo.model(name).manifest, name.startswith("m")
        form = {"m1_n3": "straight", "m3_n4": "lanes"}.get(name, name)
        with row(name):
            assert manifest["functions"][FUNCTION]["emission"] == form
            assert manifest["functions"]["energy"]["emission"] in ("straight", "loops")
            assert manifest.get("forms") == (RULE if auto else None)


def test_eliminations_written_out_are_the_same():
    """Bit for bit, of one right-hand side and of several side by side; pivots are guarded."""
    for size in ((1, 1), (2, 1), (3, 2), (4, 1)):
        for name in (FUNCTION, "forward_dynamics_derivatives", "pfl"):
            whole = inlined(assemble(CATALOGUE[name], Tail(*size), "lanes"))
            largest = max(s.size for s, _ in statements(whole.body) if isinstance(s, Factor))
            straight, given = unrolled_ldl(whole, largest), arguments(whole)
            with row(name, size):
                beyond = unrolled_ldl(whole, largest - 1)  # larger matrices keep their loops
                assert {Factor, Solve} <= {type(s) for s, _ in statements(beyond.body)}
                assert not {Factor, Solve} & {type(s) for s, _ in statements(straight.body)}
                found = outputs(straight, given)
                for key, expected in outputs(whole, given).items():
                    np.testing.assert_array_equal(found[key], expected)
                wrong = given | {"torso_inertia": [-1e3] * 3}
                pivots, same = (
                    [float(np.min(x)) for _, x in Run(p, Numbers(np), wrong).guards]
                    for p in (whole, straight)
                )
                assert min(pivots) < 0 and min(same) < 0

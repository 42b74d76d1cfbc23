"""Long segments by doubling: they mean what their links mean one by one, to rounding."""

from functools import cache
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.sweeps.doubling import is_doubled
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.targets.c.form import RULE, fastest
from tests.functions.test_columns import arguments
from tests.references.exact_chain import ExactChain
from tests.references.metrics import block_error, equilibrated_condition
from tests.references.parameters import TABLE_1, random_states
from tests.support.models import model_folder

FUNCTION = "forward_dynamics"
# rad a joint: turns that lie on one another; rad a segment: an arc, a roll, nothing
BENDS = {"coiled": (0.11, 0.04), "arc": (1.0, 0.3), "rolled": (3.0, -2.0), "straight": (0.0, 0.0)}
PER_CONDITION = 5e-15  # of v_dot over the condition number of H, as of link by link


def in_digits(program, given, digits=40):
    """v_dot of a run in that many digits, of numbers and of arrays of them."""
    context = mpmath.mp.clone()
    context.dps = digits
    exact = {name: [context.mpf(x) for x in values] for name, values in given.items()}
    names = ("sin", "cos", "sqrt")
    functions = {name: np.frompyfunc(getattr(context, name), 1, 1) for name in names}
    numbers = Numbers(SimpleNamespace(**functions), context.mpf)
    return Run(program, numbers, exact).values["v_dot"]


@pytest.mark.parametrize("size", [(1, 96), (1, 128), (1, 171), (2, 96)], ids=str)
@pytest.mark.parametrize("bend", [0.0, 0.05, 1.3], ids=["straight", "bent", "coiled"])
def test_chains_of_links_mean_what_links_mean_to_40_digits(size, bend):
    tail = Tail(*size)
    plain, doubled = (assemble(FUNCTIONS[FUNCTION], tail, form) for form in ("lanes", "segments"))
    assert is_doubled(tail) and plain != doubled
    given = arguments(plain)
    given["q"][7:] = [bend, -bend / 3, bend / 2, bend][: 2 * tail.segments]
    expected, found = (in_digits(program, given) for program in (plain, doubled))
    largest = max(abs(x) for x in expected)
    assert max(abs(x - y) for x, y in zip(found, expected, strict=True)) <= 1e-30 * largest


@cache
def chain(size):
    """The exact chain of one size."""
    return ExactChain(TABLE_1, *size)


def states(size, kind):
    """Two tuples (q, v, v_dot, tau)."""
    per_joint = 1 if kind == "coiled" else 1 / size[1]
    for q, *others in zip(*random_states(size[0], 11, 2, "random"), strict=True):
        q[7:] = np.tile(BENDS[kind], size[0]) * per_joint
        yield q, *others


slow = pytest.mark.slow
SIZES = [(1, 96), *(pytest.param(size, marks=slow) for size in ((1, 171), (1, 512), (3, 144)))]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("kind", BENDS)
def test_accelerations_are_exact_to_rounding(size, kind):
    model, exact = st.load(model_folder(*size, functions=[FUNCTION])), chain(size)
    assert model.manifest["functions"][FUNCTION]["emission"] == "segments"
    assert is_doubled(Tail(*size))
    for q, v, _, tau in states(size, kind):
        error = block_error(model.forward_dynamics(q, v, tau), exact.forward_dynamics(q, v, tau))
        condition = equilibrated_condition(exact.mass_matrix(q))
        assert error / condition <= PER_CONDITION * (1 + size[0] * size[1] / 256)


@pytest.mark.parametrize(
    ("size", "doubled"),
    [((1, 32), False), ((1, 95), False), ((1, 96), True), ((1, 127), True), ((2, 64), False),
     ((2, 96), True), ((8, 64), False), ((8, 256), True)],
)  # fmt: skip
def test_doubling_is_chosen_where_it_is_faster(size, doubled):
    assert is_doubled(Tail(*size)) == doubled


def test_one_long_segment_goes_by_doubling():
    assert fastest(FUNCTIONS[FUNCTION], Tail(1, 96))[0] == "segments"


@pytest.mark.parametrize("size", [(2, 15), (2, 16), (4, 3), (4, 4), (7, 1), (8, 1)])
def test_several_segments_are_swept_one_by_one_from_the_work_that_the_rule_names(size):
    """Columns of the tail in H, times links: 128 in three of these sizes."""
    columns, links = 2 * size[0], size[0] * size[1]
    long = columns * links >= RULE["segments_from"]
    assert fastest(FUNCTIONS[FUNCTION], Tail(*size))[0] == ("segments" if long else "lanes")
    assert fastest(FUNCTIONS["mass_matrix"], Tail(1, 96))[0] == "loops"


@pytest.mark.parametrize(
    ("options", "limit"),
    [({"real": "float"}, 1e-3), ({"profile": "reproducible"}, 1e-13), ({"baked": True}, 1e-13)],
)
def test_doubling_serves_every_kind_of_scene(options, limit):
    model = st.load(model_folder(1, 96, functions=[FUNCTION], **options))
    q, v, _, tau = next(states((1, 96), "arc"))
    expected = chain((1, 96)).forward_dynamics(q, v, tau)
    assert block_error(model.forward_dynamics(q, v, tau), expected) <= limit

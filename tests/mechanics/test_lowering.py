"""Lowering keeps what SymPy means; steps have names of their own, and stay within their budgets."""

import math

import pytest
import sympy
from sympy import Matrix, Rational

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.ir.program import Apply, statements
from serpentail_codegen.ir.tape import operation_count, replay
from serpentail_codegen.mechanics import link
from serpentail_codegen.mechanics.lower import Recorder, derive

from .exact import EXACT

# Lowering.


def lowered(e, **numbers):
    """Lower an expression and evaluate it at numbers."""
    recorder = Recorder()
    symbols = {
        name: recorder.symbol(name, recorder.tape.input(k)) for k, name in enumerate(numbers)
    }
    node = recorder.lower(sympy.sympify(e, locals=symbols))
    return replay(recorder.tape.nodes, list(numbers.values()), EXACT)[node]


@pytest.mark.parametrize(
    "text",
    [
        "x + y - 3*x*y",
        "2*x/3",
        "-x/y",
        "x**3",
        "x**-2",
        "y/(3*x)",
        "1/(x + y)",
        "x*y/(x - y)/2",
        "(x + 1)**2*y",
        "-3",
    ],
)
def test_lowering_keeps_the_value(text):
    x, y = Rational(3, 7), Rational(-5, 2)
    assert lowered(text, x=x, y=y) == sympy.sympify(text).subs({"x": x, "y": y})


@pytest.mark.parametrize("text", ["tan(x)", "x**y", "x**Rational(1, 3)", "exp(x)", "pi*x"])
def test_what_has_no_rule_is_refused(text):
    with pytest.raises(TypeError, match="no rule lowers"):
        lowered(text, x=1, y=1)


def test_let_names_what_is_not_a_symbol_or_number():
    recorder = Recorder()
    x, y = recorder.vector("x", 0, 2)
    named = recorder.let("m", Matrix([[x, 2], [x * y, x + y]]))
    assert (named[0, 0], named[0, 1]) == (x, 2)
    assert named[1, 0].is_Symbol and named[1, 1].is_Symbol and named[1, 0] != named[1, 1]
    assert recorder.lower(named[1, 0]) == recorder.lower(x * y)


# Choices.


@pytest.mark.parametrize("y", [-1.0, 0.0, 2.0])
@pytest.mark.parametrize("x", [-1.0, 0.0, 2.0])
def test_choices_are_lowered_as_sympy_means_them(x, y):
    a, b = sympy.symbols("a b")
    choices = [
        sympy.Piecewise((a, a > b), (b + 1, True)),
        sympy.Piecewise((a, a >= b), (b + 1, True)),
        sympy.Piecewise((a, a < b), (b + 1, True)),
        sympy.Piecewise((a, b <= a), (3, a < 0), (b + 1, True)),
        sympy.Max(a, b),
        sympy.Max(a, b, 1) - sympy.Max(a * b, -1),
    ]
    recorder = Recorder()
    recorder.node_of |= {symbol: recorder.tape.input(k) for k, symbol in enumerate((a, b))}
    nodes = [recorder.lower(e) for e in choices]
    found = replay(recorder.tape.nodes, [x, y], Numbers(math, float))
    assert [found[n] for n in nodes] == [float(e.subs({a: x, b: y})) for e in choices]


@pytest.mark.parametrize(
    "e", ["Piecewise((a, a > 0))", "Piecewise((a, Eq(a, b)), (b, True))", "Min(a, b)"]
)
def test_choices_that_no_rule_lowers_are_refused(e):
    recorder = Recorder()
    symbols = {name: recorder.symbol(name, recorder.tape.input(k)) for k, name in enumerate("ab")}
    with pytest.raises(TypeError, match="no rule lowers"):
        recorder.lower(sympy.sympify(e, locals=symbols))


# Steps as a whole.


def applied_steps():
    """Every step that a function applies, for several sizes."""
    for tail in (Tail(1, 1), Tail(1, 3), Tail(3, 2), Tail(2, 3, "continuum")):
        for function in FUNCTIONS.values():
            for statement, _ in statements(assemble(function, tail).body):
                if isinstance(statement, Apply):
                    yield statement.step


def test_a_name_means_one_step():
    steps = {}
    for step in applied_steps():
        assert steps.setdefault(step.name, step) == step
    assert len(steps) > 40


def test_derived_steps_are_named_after_their_function():
    step = derive(link.link_wrench)
    assert (step.name, step.outputs) == ("link_wrench", (("F", 6),))
    assert step.inputs == (("link", 6), ("w", 3), ("w_dot", 3), ("a_joint", 3), ("swing", 3))
    assert (
        step.doc
        == "Inertial wrench of one link at its joint (Eq. 17), Newton and Euler in the link frame."
    )
    assert derive(link.link_wrench) is step


# Costs: additions, subtractions, multiplications and divisions.


class Counting:
    """The algebra that counts its operations."""

    def __init__(self):
        self.count = 0

    def __getattr__(self, op):
        def applied(*_):
            self.count += op in ("add", "sub", "mul", "div")

        return applied


def executed(name, m, n):
    """Operations that a function executes in loops."""
    p, algebra = assemble(FUNCTIONS[name], Tail(m, n)), Counting()
    Run(
        p,
        algebra,
        {a.name: [None] * a.length for a in (*p.of_role("parameters"), *p.of_role("input"))},
    )
    return algebra.count


def straight(name, m, n):
    """Operations of a function without loops."""
    tape, outputs, guards = unroll(assemble(FUNCTIONS[name], Tail(m, n)))
    guarded = [node for _, node in guards]
    return operation_count(
        tape.nodes, [node for nodes in outputs.values() for node in nodes] + guarded
    )


def step_cost(*functions):
    """Operations of derived steps."""
    return sum(operation_count(step.nodes, step.results) for step in map(derive, functions))


def test_steps_stay_within_their_budgets():
    assert step_cost(link.gather_links) <= 140
    assert step_cost(link.link_motion, link.link_wrench) <= 95
    assert step_cost(link.gather_wrench) <= 36


def test_functions_stay_within_their_budgets():
    assert straight("forward_dynamics", 1, 3) <= 1040
    assert executed("forward_dynamics", 3, 4) <= 5340

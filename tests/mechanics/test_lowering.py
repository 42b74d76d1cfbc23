"""Lowering keeps what SymPy means; steps have names and shapes of their own, and stay within their
budgets.
"""

import math
from itertools import product

import pytest
import sympy
from sympy import Matrix, Rational

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.ir.program import Apply, statements
from serpentail_codegen.ir.tape import operation_count, replay
from serpentail_codegen.mechanics import link
from serpentail_codegen.mechanics.lower import Recorder, declared_shapes, derive
from serpentail_codegen.mechanics.shapes import M33, V1, V3
from tests.support.rows import row

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


def test_lowering_keeps_the_value():
    x, y = Rational(3, 7), Rational(-5, 2)
    powers = ("x**3", "x**-2", "(x + 1)**2*y")
    quotients = ("2*x/3", "-x/y", "y/(3*x)", "1/(x + y)", "x*y/(x - y)/2")
    for text in ("x + y - 3*x*y", "-3", *powers, *quotients):
        assert lowered(text, x=x, y=y) == sympy.sympify(text).subs({"x": x, "y": y}), text


def test_what_has_no_rule_is_refused():
    choices = ("Piecewise((x, x > 0))", "Piecewise((x, Eq(x, y)), (y, True))", "Min(x, y)")
    for text in ("tan(x)", "x**y", "x**Rational(1, 3)", "exp(x)", "pi*x", *choices):
        with row(text), pytest.raises(TypeError, match="no rule"):
            lowered(text, x=1, y=1)


def test_let_names_what_is_not_a_symbol_or_number():
    recorder = Recorder()
    x, y = recorder.vector("x", 0, 2)
    named = recorder.let("m", Matrix([[x, 2], [x * y, x + y]]))
    assert (named[0, 0], named[0, 1]) == (x, 2)
    assert named[1, 0].is_Symbol and named[1, 1].is_Symbol and named[1, 0] != named[1, 1]
    assert recorder.lower(named[1, 0]) == recorder.lower(x * y)


# Choices.


def test_choices_are_lowered_as_sympy_means_them():
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
    for x, y in product((-1.0, 0.0, 2.0), repeat=2):
        found = replay(recorder.tape.nodes, [x, y], Numbers(math, float))
        expected = [float(e.subs({a: x, b: y})) for e in choices]
        assert [found[n] for n in nodes] == expected, (x, y)


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
    assert step.doc == link.link_wrench.__doc__
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
    given = (*p.of_role("parameters"), *p.of_role("input"))
    Run(p, algebra, {a.name: [None] * a.length for a in given})
    return algebra.count


def straight(name, m, n):
    """Operations of a function without loops."""
    tape, outputs, guards = unroll(assemble(FUNCTIONS[name], Tail(m, n)))
    results = [node for nodes in outputs.values() for node in nodes]
    return operation_count(tape.nodes, results + [node for _, node in guards])


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


# Shapes: a step says by annotations how many numbers its vectors hold.


def carried(let, R: M33, arm: V3, scale: V1) -> dict:
    """A turned and scaled arm."""
    return {"carried": R * arm * scale[0], "matrix": R}


def unannotated(let, R: M33, arm) -> dict:
    """An arm of no shape."""
    return {"carried": R * arm}


def mistyped(let, R: M33, arm: Matrix) -> dict:
    """An arm whose type tells no shape."""
    return {"carried": R * arm}


def with_setting(let, arm: V3, twice: bool = False) -> dict:
    """An argument with a default is a setting."""
    return {"carried": arm * (2 if twice else 1)}


def test_a_step_reads_what_its_annotations_say():
    assert declared_shapes(carried) == {"R": (3, 3), "arm": (3, 1), "scale": (1, 1)}
    step = derive(carried)
    assert step.inputs == (("R", 9), ("arm", 3), ("scale", 1))
    assert step.outputs == (("carried", 3), ("matrix", 9))
    assert declared_shapes(with_setting) == {"arm": (3, 1)}


def test_wrong_shapes_are_refused():
    for function in (unannotated, mistyped):
        with pytest.raises(TypeError, match=f"{function.__name__}: arm"):
            derive(function)
    for name, size in (("R", 3), ("arm", 4), ("carried", 2)):
        sizes = {"R": 9, "arm": 3, "scale": 1, "carried": 3} | {name: size}
        builder = Builder("applied", "A step applied.")
        refs = {vector: builder.array(vector, count)[0] for vector, count in sizes.items()}
        writes = {"carried": refs.pop("carried")}
        right = {"R": 9, "arm": 3, "carried": 3}[name]
        with (
            row(name),
            pytest.raises(ValueError, match=f"carried.*applied.*{name}.*{right}.*{size}"),
        ):
            builder.apply(derive(carried), refs, **writes)

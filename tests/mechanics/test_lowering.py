"""Lowering keeps what SymPy means; steps have names and shapes of their own, and stay within their
budgets.
"""

import math
from itertools import product

import pytest
import sympy
from sympy import Matrix, Rational

from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.cost import executed
from serpentail_codegen.ir.interpret import Numbers
from serpentail_codegen.ir.program import Apply, statements
from serpentail_codegen.ir.tape import operation_count, replay
from serpentail_codegen.mechanics import link
from serpentail_codegen.mechanics.lower import Recorder, declared_shapes, derive
from serpentail_codegen.mechanics.shapes import M33, V1, V3
from tests.support.rows import row

from .exact import EXACT


def lowered(e, **numbers):
    """Lower an expression and evaluate it at numbers."""
    recorder, symbols = Recorder(), {}
    for k, name in enumerate(numbers):
        symbols[name] = recorder.symbol(name, recorder.tape.input(k))
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


def test_choices_are_lowered_as_sympy_means_them():
    a, b = sympy.symbols("a b")
    choices = [
        *(sympy.Piecewise((a, c), (b + 1, True)) for c in (a > b, a >= b, a < b)),
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


def test_a_name_means_one_step_and_steps_stay_within_their_budgets():
    steps = {}
    for tail in (Tail(1, 1), Tail(1, 3), Tail(3, 2), Tail(2, 3, "continuum")):
        for function in FUNCTIONS.values():
            for statement, _ in statements(assemble(function, tail).body):
                if isinstance(statement, Apply):
                    step = statement.step
                    assert steps.setdefault(step.name, step) == step
    assert len(steps) > 40
    operations = {name: operation_count(s.nodes, s.results) for name, s in steps.items()}
    assert operations["gather_links"] <= 140
    assert operations["link_motion"] + operations["link_wrench"] <= 95
    assert operations["gather_wrench"] <= 36
    assert executed(assemble(FUNCTIONS["forward_dynamics"], Tail(3, 4))) <= 5340


def test_derived_steps_are_named_after_their_function():
    step = derive(link.link_wrench)
    assert (step.name, step.outputs) == ("link_wrench", (("F", 6),))
    assert step.inputs == (("link", 6), ("w", 3), ("w_dot", 3), ("a_joint", 3), ("swing", 3))
    assert step.doc == link.link_wrench.__doc__
    assert derive(link.link_wrench) is step


def carried(let, R: M33, arm: V3, scale: V1) -> dict:
    """A turned and scaled arm."""
    return {"carried": R * arm * scale[0], "matrix": R}


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
    def shapeless(let, R: M33, arm: Matrix) -> dict:
        return {"carried": R * arm}

    with pytest.raises(TypeError, match="shapeless: arm"):
        derive(shapeless)
    right = {"R": 9, "arm": 3, "scale": 1, "carried": 3}
    for name, size in (("R", 3), ("arm", 4), ("carried", 2)):
        builder = Builder("applied", "A step applied.")
        refs = {each: builder.array(each, n)[0] for each, n in (right | {name: size}).items()}
        written = refs.pop("carried")
        words = f"carried.*applied.*{name}.*{right[name]}.*{size}"
        with row(name), pytest.raises(ValueError, match=words):
            builder.apply(derive(carried), refs, carried=written)

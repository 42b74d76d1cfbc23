"""Mutants change what runs and nothing that only tells, and are judged by the tests that run it."""

from pathlib import Path

from mutants import python_source, results, sample, template_source
from mutants.mutation import Mutation
from mutants.recorded import NO_JUDGES
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
TOLD = '''"""Docs 1 < 2."""
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from a import b as c


@cached(3)
def f(x: Literal[3]) -> Literal[4]:
    """Docs 1 < 2."""
    raise StateError(f"{x + 1}: needs 3")
'''
PYTHON = {
    "a < b": {"a < b -> a <= b", "a < b -> a >= b", "a < b -> pass"},
    "x = a + b": {"a + b -> a - b"},
    "x = 'a' + b": set(),
    "x = a and b": {"a and b -> a or b"},
    "x = not a": {"not a -> a"},
    "x = 3": {"3 -> 4"},
    "x = 2.0": {"2.0 -> 3.0"},
    "x = 0.0": {"0.0 -> 1.0"},
    "x = True": {"True -> False"},
    "x = f(a, b)": {"f(a, b) -> f(b, a)"},
    "x = f(a, b=c)": {"f(a, b=c) -> f(a)"},
    "x.y = z": {"x.y = z -> pass"},
    "x += y": {"x += y -> pass", "x += y -> x -= y"},
    "f()": {"f() -> pass"},
    "if x:\n    y = z": {"x -> not x"},
    "x = [a for a in b if c]": {"[a for a in b if c] -> [a for a in b]"},
    "def f():\n    return x": {"return x -> return None"},
    TOLD: {"raise StateError(f'{x + 1}: needs 3') -> pass"},
}
TEMPLATES = {
    "  x = a + b;": {" + -> -", "x = a + b; -> ;"},
    "  const real x = a * b;": {"* -> /"},
    "  real *const x = a;": set(),
    "  if (a < {{ 0 | number }}) {": {"< -> <=", "< -> >=", "0 -> 1"},
    "/* a < 3 */ {# 4 #}": set(),
    '#include "a.h"\n#define A 3': set(),
    "{% if has.contacts %}": {"has.contacts -> not (has.contacts)"},
    "  f(a, 1);": {"1 -> 2", "f(a, 1); -> ;"},
    "  return a;": set(),
    "  if (!a) {": {"! -> (nothing)", "!a -> !(!a)"},
}


def test_mutants_change_what_runs_and_not_what_only_tells():
    for text, changes in PYTHON.items():
        with row(text):
            assert {m.change for m in python_source.mutations("a.py", text.encode())} == changes
    for text, changes in TEMPLATES.items():
        with row(text):
            mutations = template_source.mutations("a.c.jinja", text.encode())
            found = {m.change.strip() for m in mutations if "->" in m.change}
            found -= {"a < {{ 0 | number }} -> !(a < {{ 0 | number }})"}
            assert found == {change.strip() for change in changes}


def test_the_score_leaves_out_what_is_argued_of_lines_that_are_there(monkeypatch):
    for entry in results.arguments():
        with row(entry):
            of_file = sample.of_file(ROOT, entry["file"])
            assert any(results.argument(mutation, [entry]) for mutation in of_file)
    assert all((ROOT / name).is_file() for name in NO_JUDGES)
    of, changes = "runtime/serpentail/a.py", [(True, "a -> b"), (False, "a -> b"), (False, "c")]
    why = {"file": of, "line": "x", "change": "a -> b", "why": "the same"}
    monkeypatch.setattr(results, "arguments", lambda: [why])
    found = [
        results.Verdict(Mutation(of, 1, 0, 1, "", "x", change), killed, "", "", 1, 1.0, "", "")
        for killed, change in changes
    ]
    told = results.report(found)
    assert results.score(found) == 50 and told.count("SURVIVED") == 1 and "the same" in told

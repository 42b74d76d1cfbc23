"""Mutants change what runs and nothing that only tells, and are judged by the tests that run it."""

import ast
from pathlib import Path
from types import SimpleNamespace

from mutants import judge, python_source, results, sample, template_source
from mutants.mutation import Mutation
from mutants.recorded import NO_JUDGES, own_lines
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


def test_a_sample_is_of_programs_of_all_parts_and_grows(tmp_path):
    for folder, suffix in sample.PARTS.values():
        for path in sorted((ROOT / folder).rglob(f"*{suffix}"))[3:9:2]:
            copy = tmp_path / path.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(path.read_bytes())
    few, many = sample.drawn(tmp_path, 30, 7), sample.drawn(tmp_path, 60, 7)
    assert many[:30] == few != sample.drawn(tmp_path, 30, 8)
    assert len({mutation.key for mutation in many}) == 60
    parts = [sample.part_of(mutation.path) for mutation in few]
    assert [parts.count(part) for part in sample.PARTS] == [10, 10, 10]
    (path,) = {mutation.path for mutation in sample.drawn(tmp_path, 30, 7, few[0].path)}
    assert path == few[0].path
    for mutation in (m for m in many if m.path.endswith(".py")):
        source = (ROOT / mutation.path).read_bytes()
        assert ast.dump(ast.parse(mutation.of(source))) != ast.dump(ast.parse(source))


def test_the_nearest_files_judge_first_and_alone_where_no_test_runs_the_line():
    source = "codegen/serpentail_codegen/targets/c/templates/batch/lane_samples.c.jinja"
    names = ("simulation/test_adaptive_lanes", "c/batches/test_kernels", "fuzz/test_plans")
    assert [judge.nearness(source, f"tests/{name}.py") for name in names] == [1, 2, 0]
    passed = {"tests/sweeps/test_kills.py": ["kills"], "tests/fuzz/test_plans.py": ["plans"]}
    child = Mutation("runtime/serpentail/sweeps/child.py", 1, 0, 1, "", "", "")
    for runs in (True, False):
        recorder = SimpleNamespace(
            files=lambda: list(passed),
            cost=lambda file: 1.0,
            chosen=lambda _, file, runs=runs: [["plans"] if runs and "plans" in file else []],
            of=lambda file: SimpleNamespace(passed=passed[file]),
        )
        assert list(judge.rows(recorder, child)) == [["plans" if runs else "kills"]]
    tree = ast.parse("if (a and\n    b):\n    c()\nd()\n")
    assert [list(own_lines(node)) for node in tree.body] == [[1, 2], [4]]


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

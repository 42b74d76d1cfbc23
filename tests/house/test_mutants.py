"""Mutants change what runs and nothing that only tells, and are what the tests have loaded."""

import ast
import os
import runpy
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

from mutants import judge, processes, python_source, sample, template_source
from mutants.mutation import Mutation
from mutants.recorded import NO_JUDGES, own_lines
from mutants.results import Verdict, argument, arguments, report, score
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


def python(text):
    return {m.change for m in python_source.mutations("a.py", text.encode())}


def template(text):
    return {m.change for m in template_source.mutations("a.c.jinja", text.encode())}


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


def test_what_runs_is_changed_and_not_what_only_tells():
    for text, changes in PYTHON.items():
        with row(text):
            assert python(text) == changes
    for text, changes in TEMPLATES.items():
        with row(text):
            found = {change.strip() for change in template(text) if "->" in change}
            found -= {"a < {{ 0 | number }} -> !(a < {{ 0 | number }})"}
            assert found == {change.strip() for change in changes}


def test_mutants_of_sources_are_programs_of_their_own():
    """Of a few sources, spread over all."""
    files = [p for part in ("generator", "runtime") for p in sources(part)[::15]]
    for path in files:
        found, source = [*sample.of_file(ROOT, path)], (ROOT / path).read_bytes()
        assert len({mutation.key for mutation in found}) == len(found)
        for mutation in found[::40]:
            assert ast.dump(ast.parse(mutation.of(source))) != ast.dump(ast.parse(source))


def sources(part):
    folder, suffix = sample.PARTS[part]
    return sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / folder).rglob(f"*{suffix}"))


def test_a_sample_is_of_all_parts_and_grows(tmp_path):
    for part in sample.PARTS:
        for name in sources(part)[3:9:2]:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    few, many = sample.drawn(tmp_path, 30, 7), sample.drawn(tmp_path, 60, 7)
    assert many[:30] == few != sample.drawn(tmp_path, 30, 8)
    parts = [sample.part_of(mutation.path) for mutation in few]
    assert [parts.count(part) for part in sample.PARTS] == [10, 10, 10]
    (path,) = {mutation.path for mutation in sample.drawn(tmp_path, 30, 7, few[0].path)}
    assert path == few[0].path


def test_a_mutant_says_that_it_was_loaded(tmp_path):
    more = '"""Docs.\n\nMore.\n"""\n\nfrom __future__ import annotations\n'
    for k, head in enumerate(['"""Docs."""\n', more]):
        witness, file = tmp_path / f"witness{k}", tmp_path / f"mutant{k}.py"
        text = f"{head}\nimport math\n\nX = math.pi\nraise ValueError\n".encode()
        file.write_bytes(python_source.with_first(text, f"open({str(witness)!r}, 'w').close()"))
        assert len(file.read_bytes().splitlines()) == len(text.splitlines())
        with row(head), pytest.raises(ValueError, match=r"^$"):
            runpy.run_path(str(file))
        assert witness.exists()


def test_what_is_late_on_a_busy_machine_gets_more_time(monkeypatch):
    """Late with and without the mutant: the machine is busy.  Late with it alone: it is noticed."""
    told, patient = [], []

    def failed(place, mutation, tests, patience=1.0):
        patient.append(patience)
        with_mutant, needed = told[-1] == b"mutant", 4.0 if place.hangs else 2.0
        if patience >= needed and not (place.hangs and with_mutant):
            return None
        return place.end, "Failed: Timeout (>120.0s) from pytest-timeout."

    monkeypatch.setattr(judge.tree, "BASE", ROOT)
    monkeypatch.setattr(judge.Tree, "_failed", failed)
    monkeypatch.setattr(judge.Tree, "_plant", lambda place, mutation, text: told.append(text))
    place = object.__new__(judge.Tree)
    place.recorder = SimpleNamespace(distrusted=set(), trusted={"tests/a.py::test_b"})
    change = Mutation("runtime/serpentail/attitude.py", 1, 0, 0, "", "", "")
    for place.end in ("timeout", "tests/a.py::test_b"):
        for place.hangs, tries in [(False, [1, 1, 2]), (True, [1, 1, 2, 2, 4, 4])]:
            told[:], patient[:] = [b"mutant"], []
            found = place._noticed(change, b"mutant", ["tests/a.py::test_b"])
            assert (found and found[0], patient) == (place.end if place.hangs else None, tries)
            assert told[-1] == b"mutant" and not place.recorder.distrusted


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


def test_the_score_leaves_out_what_is_argued(monkeypatch):
    of, changes = "runtime/serpentail/a.py", [(True, "a -> b"), (False, "a -> b"), (False, "c")]
    why = {"file": of, "line": "x", "change": "a -> b", "why": "the same"}
    monkeypatch.setattr("mutants.results.arguments", lambda: [why])
    found = [
        Verdict(Mutation(of, 1, 0, 1, "", "x", change), killed, "", "", 1, 1.0, "", "")
        for killed, change in changes
    ]
    told = report(found)
    assert score(found) == 50 and told.count("SURVIVED") == 1 and "the same" in told


def test_every_argument_is_of_a_line_that_is_there_and_judges_exist():
    """One whose line has changed must be thought about again."""
    for entry in arguments():
        with row(entry):
            assert any(argument(m, [entry]) for m in sample.of_file(ROOT, entry["file"]))
            assert len(entry["why"]) > 20
    assert all((ROOT / name).is_file() for name in NO_JUDGES)


def test_an_interrupted_run_ends_its_processes_at_once_and_believes_none(monkeypatch, tmp_path):
    monkeypatch.setattr(processes, "stopped", threading.Event())
    begun, own = tmp_path / "begun", {**os.environ}
    assert processes.run(["sleep", "600"], tmp_path, own, 0.1) == (None, "")
    told = processes.run(["sh", "-c", "echo told; exit 3"], tmp_path, own, 60.0)
    assert told == (3, "told\n")
    with ThreadPoolExecutor(1) as pool:
        words = ["sh", "-c", f"touch {begun}; sleep 600"]
        tests = pool.submit(processes.run, words, tmp_path, own, 600)
        while not begun.exists():
            time.sleep(0.01)
        processes.stop()
        with pytest.raises(processes.Stopped):
            tests.result(60)
    assert not processes.running
    with pytest.raises(processes.Stopped):
        processes.run(["true"], tmp_path, own, 600)

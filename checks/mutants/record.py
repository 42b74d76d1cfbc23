"""A plugin of pytest that records which test runs which line of the sources, and which scenes a
file of tests has generated: a scene's lines are those of its generation.
"""

import functools
import gc
import json
import os
import time
from collections import defaultdict
from pathlib import Path

import coverage
import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [str(ROOT / "codegen"), str(ROOT / "runtime")]
SCENE = "scene:"

tracer = coverage.Coverage(data_file=None, config_file=False, source=SOURCES, messages=False)
tracer.start()

from tests.support import models  # noqa: E402 - what it imports is recorded

tests: dict[str, dict] = {}
scenes: set[str] = set()
current = [""]  # the context of the lines that run now


def entered(context: str) -> None:
    """Assign all lines that run from now on to a test or to a scene."""
    current[0] = context
    tracer.switch_context(context)


def noted(scene):
    """Record the scene whose folder a test asks for."""
    scenes.add(models.digest(repr(scene)))
    return folder_of(scene)


def generated(scene, output):
    """Generate as if nothing had been generated before, so that all lines of it run."""
    before = current[0]
    entered(SCENE + models.digest(repr(scene)))
    for thing in gc.get_objects():
        if isinstance(thing, functools._lru_cache_wrapper) and of_generator(thing):
            thing.cache_clear()
    try:
        return generate(scene, output)
    finally:
        entered(before)


def of_generator(cached) -> bool:
    """Tell if a function is one of the generator's."""
    return (getattr(cached, "__module__", None) or "").startswith("serpentail_codegen")


folder_of, generate = models.folder_of, models.generate
models.folder_of, models.generate = noted, generated


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Record each test by its own name."""
    begun = time.perf_counter()
    entered(item.nodeid)
    tests[item.nodeid] = {"passed": True}
    try:
        return (yield)
    finally:
        tests[item.nodeid]["seconds"] = round(time.perf_counter() - begun, 3)
        entered("")


def pytest_runtest_logreport(report):
    """A test that fails or is skipped without a mutant can judge none."""
    if report.outcome != "passed":
        tests[report.nodeid]["passed"] = False


def pytest_sessionfinish():
    """Write what was recorded."""
    tracer.stop()
    data = tracer.get_data()
    by_scene, by_test = defaultdict(dict), {}
    for file in data.measured_files():
        name, by_context = Path(file).relative_to(ROOT).as_posix(), defaultdict(list)
        for line, contexts in data.contexts_by_lineno(file).items():
            for context in contexts:
                by_context[context].append(line)
        by_test[name] = {k: v for k, v in by_context.items() if not k.startswith(SCENE)}
        for context in by_context.keys() - by_test[name].keys():
            by_scene[context.removeprefix(SCENE)][name] = by_context[context]
    told = {"tests": tests, "scenes": sorted(scenes), "lines": by_test, "scene_lines": by_scene}
    Path(os.environ["SERPENTAIL_RECORD"]).write_text(json.dumps(told))

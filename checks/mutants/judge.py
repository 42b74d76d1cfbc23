"""Runs the tests that should notice a mutant, in a separate copy of the sources."""

import contextlib
import json
import os
import shutil
import zlib
from collections.abc import Iterator
from pathlib import Path

from . import tree
from .mutation import Mutation
from .processes import run
from .python_source import with_first
from .recorded import Recorder
from .sample import part_of

STARTING = 40.0  # s that a process may take in addition to its tests
SLOWER = 6.0  # factor by which a mutant's tests may be slower
FIRST = 15.0  # s of tests that the first process of a mutant runs; each other four times as many
HUNG = "Timeout ("  # what faulthandler says before it ends a process
LONGEST = 1200.0  # s of tests after which a mutant has survived


class NotLoaded(Exception):
    """Tests failed although the mutant was never loaded: it is not the reason."""


class Tree:
    """A copy of the sources that holds one mutant after the other."""

    def __init__(self, name: str, recorder: Recorder):
        self.root, self.recorder = tree.planted(name), recorder

    def judged(
        self, mutation: Mutation, mutated: bytes, most: float = LONGEST
    ) -> tuple[bool, str, str, int]:
        """Return whether tests notice a mutated file, which did, its words, and how many ran; at
        most so many seconds of tests.
        """
        self._plant(mutation, mutated)
        ran = 0
        try:
            for tests in packed(self.recorder, mutation, most):
                ran += len(tests)
                found = self._noticed(mutation, mutated, tests)
                if found:
                    return True, *found, ran
            return False, "", "" if ran else "no test runs this line", ran
        finally:
            shutil.copy2(tree.BASE / mutation.path, self.root / mutation.path)

    @property
    def _witness(self) -> Path:
        return self.root / ".build" / "witness"

    def _plant(self, mutation: Mutation, mutated: bytes) -> None:
        """Write the mutant, and what was compiled without it; what was generated, for the runtime
        alone.
        """
        shutil.rmtree(self.root / ".build", ignore_errors=True)
        models = ["models"] if part_of(mutation.path) == "runtime" else []
        for kept in ("cache", "objects", *models):
            made = tree.BASE / ".build" / kept
            if made.exists():
                with contextlib.suppress(shutil.Error):  # files in use may vanish
                    hidden = shutil.ignore_patterns(".*", "*.part")
                    shutil.copytree(made, self.root / ".build" / kept, ignore=hidden)
        (self.root / ".build").mkdir(exist_ok=True)
        file = self.root / mutation.path
        file.write_bytes(marked(mutation, self._witness, mutated))
        # no bytecode of another text of this size has this time
        moment = 1_000_000_000 + zlib.crc32(mutated) // 8
        os.utime(file, (moment, moment))

    def _noticed(
        self, mutation: Mutation, mutated: bytes, tests: list[str]
    ) -> tuple[str, str] | None:
        """Run tests; return which noticed the mutant and what it said.  A test that fails here for
        the first time must pass without the mutant, else it is no judge any more; what comes too
        late must come in time without it, else the machine is busy and all get more time.
        """
        patience = 1.0
        while tests := [test for test in tests if test not in self.recorder.distrusted]:
            found = self._failed(mutation, tests, patience)
            if not found or (not late(found) and self._believed(found[0], tests)):
                return found
            self._plant(mutation, (tree.BASE / mutation.path).read_bytes())
            again = [found[0]] if found[0] in tests else tests
            fails = self._failed(mutation, again, patience)
            self._plant(mutation, mutated)
            if late(found) and not fails:
                return found
            if late(found):
                patience *= 2.0
            else:
                (self.recorder.distrusted if fails else self.recorder.trusted).add(found[0])
        return None

    def _believed(self, by: str, tests: list[str]) -> bool:
        """Tell if the test that noticed a mutant is known to pass without it."""
        return by in self.recorder.trusted or by not in tests

    def _failed(
        self, mutation: Mutation, tests: list[str], patience: float = 1.0
    ) -> tuple[str, str] | None:
        """Run tests; return the first one that failed, and its message."""
        orders, verdict = self.root / ".build" / "orders", self.root / ".build" / "verdict"
        verdict.unlink(missing_ok=True)
        told = {"witness": str(self._witness), "verdict": str(verdict), "mark": mutation.key}
        told |= {"most": 1.5 * patience * tree.LONGEST_TEST}
        orders.write_text(json.dumps(told | {"tests": tests}))
        files = list(dict.fromkeys(test.split("::")[0] for test in tests))
        scratch = self.root / ".build" / "scratch"
        alone = ("-o", f"timeout={patience * tree.LONGEST_TEST:.0f}")
        words = tree.pytest_with("checks.mutants.watch", scratch, "-x", *alone, *files)
        env = tree.surroundings(self.root, scratch, SERPENTAIL_MUTANT=str(orders))
        limit = patience * (STARTING + SLOWER * seconds(self.recorder, tests))
        status, output = run(words, self.root, env, limit)
        if status == 0:
            return None
        if status == 5 or not self._witness.exists():
            raise NotLoaded(f"{mutation}: ended by {status}, not loaded: {output[-3000:]}")
        if status is None:
            return "timeout", f"{limit:.0f} s"
        found = json.loads(verdict.read_text()) if verdict.exists() else {}
        by = "timeout" if HUNG in output else "process"
        return found.get("by", by), found.get("words", output[-300:])


def late(found: tuple[str, str]) -> bool:
    """Tell if a failure only means that tests took too long."""
    return found[0] == "timeout" or "from pytest-timeout" in found[1]


def marked(mutation: Mutation, witness: Path, source: bytes) -> bytes:
    """Return a source that reports that it was loaded; its lines keep their numbers."""
    if not mutation.path.endswith(".py"):
        return source + b"{# %s #}" % mutation.key.encode()
    return with_first(source, f"open({str(witness)!r}, 'w').close()")


def packed(recorder: Recorder, mutation: Mutation, most: float) -> Iterator[list[str]]:
    """Yield the tests that run a mutated line, in groups for one process each."""
    pack: list[str] = []
    limit, spent = FIRST, 0.0
    for tests in rows(recorder, mutation):
        if pack and seconds(recorder, pack + tests) > limit:
            yield pack
            spent, limit, pack = spent + seconds(recorder, pack), 4 * limit, []
        if spent > most:
            return
        pack = pack + tests
    if pack:
        yield pack


def rows(recorder: Recorder, mutation: Mutation) -> Iterator[list[str]]:
    """Yield the tests of each file that run a mutated line: first files whose path shares most
    words with the mutant's, then those that take less, then those that must be recorded to know.
    Where none runs the line, those of the nearest files.
    """
    waiting = recorder.files()

    def rank(file: str) -> tuple[int, float]:
        return -nearness(mutation.path, file), recorder.cost(file)

    found = False
    while waiting:
        file = min(waiting, key=rank)
        waiting.remove(file)
        for tests in filter(None, recorder.chosen(mutation, file)):
            found = True
            yield tests
    if not found:  # what runs in a process of its own is not recorded
        yield from filter(None, (recorder.of(file).passed for file in nearest(recorder, mutation)))


def nearest(recorder: Recorder, mutation: Mutation) -> list[str]:
    """Return the files of tests that are nearest to a mutant, if any is near."""
    near = {file: nearness(mutation.path, file) for file in recorder.files()}
    most = max(near.values())
    return [file for file, count in near.items() if count == most > 0]


def nearness(path: str, file: str) -> int:
    """Return how many words the paths of a source and of a file of tests share."""
    return len(words(Path(path)) & words(Path(file)))


def words(path: Path) -> set[str]:
    """Return the words of a path in the singular: of its folders and of its file."""
    parts = (*path.parts[1:-1], path.name.split(".")[0].removeprefix("test_"))
    found = {word for part in parts for word in part.split("_")}
    return {word.removesuffix("s").removesuffix("e") for word in found}


def seconds(recorder: Recorder, tests: list[str]) -> float:
    """Return how long tests took without a mutant."""
    return sum(recorder.of(t.split("::")[0]).tests[t]["seconds"] for t in tests if "::" in t)

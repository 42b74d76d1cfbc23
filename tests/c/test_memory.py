"""Emitted C at states far from ordinary: sanitizers and valgrind find nothing, and would find what
is put in.
"""

import re
import shutil

import pytest

import serpentail as st
from stress import memory
from tests.support import toolchains, zoo

FAULTS = {
    "cast": "const volatile int turns = (int)q[7];\n  (void)turns;",
    "bounds": "const volatile real beyond = q[9];\n  (void)beyond;",
    "unwritten": "volatile real lost[1];\n  if (lost[0] > 0) {\n    return 0;\n  }",
}


@pytest.fixture
def sanitized():
    """Return a compiler and what a program runs under."""
    return memory.SANITIZED, ()


@pytest.fixture
def watched():
    """Return a compiler and what a program runs under; skip, or fail in CI, without valgrind."""
    toolchains.valgrind()
    return memory.PLAIN, memory.WATCHED


@pytest.fixture
def followed():
    """Return a compiler that follows what was never written; skip, or fail in CI, without it."""
    toolchains.clang()
    return memory.FOLLOWED, ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tool", "name"),
    [(tool, "small") for tool in ("sanitized", "watched", "followed")]
    + [("watched", "ground_m1_n1")],
)
def test_nothing_is_found(tmp_path, request, tool, name):
    compiler, under = request.getfixturevalue(tool)
    of = st.load(zoo.folder(name), compiled=False)
    found = memory.every(of, 1)
    told, report = memory.answers(memory.built(of, tmp_path, *compiler), found, *under)
    assert report == "" and memory.insane(found, told) == []
    # answered, refused, and runs that ended early
    assert len({answer.status for answer in told}) >= 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tool", "fault", "words"),
    [
        ("sanitized", "cast", "is outside the range of representable values of type 'int'"),
        ("sanitized", "bounds", "heap-buffer-overflow"),
        ("watched", "bounds", "Invalid read of size"),
        ("watched", "unwritten", "depends on uninitialised"),
        ("followed", "unwritten", "use-of-uninitialized-value"),
    ],
)
def test_what_is_put_in_is_found(tmp_path, request, tool, fault, words):
    folder = shutil.copytree(zoo.folder("small"), tmp_path / "copy" / "small")
    of, source = st.load(folder, compiled=False), folder / "src" / "small.c"
    head, put = r"(int small_mass_matrix\([^)]*\)\n{\n)", FAULTS[fault]
    text, count = re.subn(head, rf"\1  {put}\n", source.read_text())
    source.write_text(text)
    (compiler, under), found = request.getfixturevalue(tool), memory.every(of, 1)
    _, report = memory.answers(memory.built(of, tmp_path, *compiler), found[:200], *under)
    assert count == 1 and words in report


def test_answers_that_are_not_sane_are_told():
    found = [memory.Case("energy", b"", memory.BATCH, refused) for refused in (True, False, False)]
    told = [memory.Answer(0, True), memory.Answer(0, False), memory.Answer(7, True)]
    assert len(memory.insane(found, told)) == 3
    assert memory.insane(found, told[:1])[0] == "1 answers to 3 cases"
    assert memory.insane(found[1:], [memory.Answer(0, True), memory.Answer(2, False)]) == []

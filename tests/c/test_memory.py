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


def tool(name):
    """A compiler, and what its programs run under; skip, or fail in CI, where it is missing."""
    if name == "watched":
        toolchains.valgrind()
        return memory.PLAIN, memory.WATCHED
    if name == "followed":  # reads of what was never written
        toolchains.clang()
        return memory.FOLLOWED, ()
    return memory.SANITIZED, ()


def report_of(folder, tmp_path, name, cases):
    """Run a model's cases under a tool; return them, the answers and what the tool says."""
    of, (compiler, under) = st.load(folder, compiled=False), tool(name)
    found = memory.every(of, 1)[cases]
    return found, *memory.answers(memory.built(of, tmp_path, *compiler), found, *under)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "of"),
    [
        *(("sanitized", "small"), ("watched", "small"), ("followed", "small")),
        *(("sanitized", "ground_m1_n1"), ("watched", "ground_m1_n1")),
    ],
)
def test_nothing_is_found(tmp_path, name, of):
    found, told, report = report_of(zoo.folder(of), tmp_path, name, slice(None))
    assert report == "" and memory.insane(found, told) == []
    # answered, refused, and runs that ended early
    assert len({answer.status for answer in told}) >= 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "fault", "words"),
    [
        ("sanitized", "cast", "is outside the range of representable values of type 'int'"),
        ("sanitized", "bounds", "heap-buffer-overflow"),
        ("watched", "bounds", "Invalid read of size"),
        ("watched", "unwritten", "depends on uninitialised"),
        ("followed", "unwritten", "use-of-uninitialized-value"),
    ],
)
def test_what_is_put_in_is_found(tmp_path, name, fault, words):
    folder = shutil.copytree(zoo.folder("small"), tmp_path / "copy" / "small")
    source, head = folder / "src" / "small.c", r"(int small_mass_matrix\([^)]*\)\n{\n)"
    text, count = re.subn(head, rf"\1  {FAULTS[fault]}\n", source.read_text())
    source.write_text(text)
    assert count == 1 and words in report_of(folder, tmp_path, name, slice(200))[2]


def test_answers_that_are_not_sane_are_told():
    found = [memory.Case("energy", b"", memory.BATCH, refused) for refused in (True, False, False)]
    told = [memory.Answer(0, True), memory.Answer(0, False), memory.Answer(7, True)]
    assert len(memory.insane(found, told)) == 3
    assert memory.insane(found, told[:1])[0] == "1 answers to 3 cases"
    assert memory.insane(found[1:], [memory.Answer(0, True), memory.Answer(2, False)]) == []

"""Emitted C at states far from ordinary: sanitizers and valgrind find nothing, and would find what
is put in.
"""

import re
import shutil

import pytest

import serpentail as st
from stress import memory
from tests.support import toolchains
from tests.support.models import model_folder

GROUND = {"contacts": ["feet", "tail", "torso"]}
MODELS = {
    "articulated": ((1, 3), {"functions": "all"}),
    "continuum": ((2, None), {"functions": "all"}),
    "segments": ((2, 2), {"functions": "all", "emission": "segments"}),
    "single": (
        (2, 2),
        {"functions": "all", "real": "float", "profile": "reproducible", "emission": "loops"},
    ),
    "small": (
        (1, 1),
        {
            "functions": ["energy", "forward_dynamics", "rollout", "implicit", "pfl"],
            "emission": "loops",
        },
    ),
}
every_model = pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) for n in MODELS if n != "small"]
)
FAULTS = {
    "cast": "const volatile int turns = (int)q[7];\n  (void)turns;",
    "overflow": "volatile int large = 2147483647;\n  large += q[3] > 0.0;",
    "bounds": "const volatile real beyond = q[NQ];\n  (void)beyond;",
    "unwritten": "volatile real lost[1];\n  if (lost[0] > 0.0) {\n    return 0;\n  }",
}


def model(name):
    """Return a model that touches the ground."""
    size, options = MODELS[name]
    return st.load(model_folder(*size, **options, **GROUND), compiled=False)


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


@every_model
@pytest.mark.parametrize("tool", ["sanitized", "watched", "followed"])
def test_nothing_is_found(tmp_path, request, name, tool):
    (compiler, under), of = request.getfixturevalue(tool), model(name)
    found = memory.every(of, 1)
    told, report = memory.answers(memory.built(of, tmp_path, *compiler), found, *under)
    assert report == "" and memory.insane(found, told) == []
    assert (
        len({answer.status for answer in told}) >= 4
    )  # answered, refused, and runs that ended early


@pytest.mark.parametrize(
    ("tool", "fault", "words"),
    [
        ("sanitized", "cast", "is outside the range of representable values of type 'int'"),
        pytest.param("sanitized", "overflow", "signed integer overflow", marks=pytest.mark.slow),
        pytest.param("sanitized", "bounds", "heap-buffer-overflow", marks=pytest.mark.slow),
        pytest.param("watched", "bounds", "Invalid read of size 8", marks=pytest.mark.slow),
        pytest.param("watched", "unwritten", "depends on uninitialised", marks=pytest.mark.slow),
        ("followed", "unwritten", "use-of-uninitialized-value"),
    ],
)
def test_what_is_put_in_is_found(tmp_path, request, tool, fault, words):
    of = st.load(
        shutil.copytree(model("small").folder, tmp_path / "copy" / model("small").name),
        compiled=False,
    )
    source = of.folder / "src" / f"{of.name}.c"
    head, put = rf"(int {of.name}_energy\([^)]*\)\n{{\n)", FAULTS[fault].replace("NQ", str(of.nq))
    text, count = re.subn(head, rf"\1  {put}\n", source.read_text())
    source.write_text(text)
    (compiler, under), found = request.getfixturevalue(tool), memory.every(of, 1)
    _, report = memory.answers(memory.built(of, tmp_path, *compiler), found, *under)
    assert count == 1 and words in report


def test_answers_that_are_not_sane_are_told():
    found = [memory.Case("energy", b"", memory.BATCH, refused) for refused in (True, False, False)]
    told = [memory.Answer(0, True), memory.Answer(0, False), memory.Answer(7, True)]
    assert len(memory.insane(found, told)) == 3
    assert memory.insane(found, told[:1])[0] == "1 answers to 3 cases"
    assert memory.insane(found[1:], [memory.Answer(0, True), memory.Answer(2, False)]) == []

"""Status 0 implies finite outputs: of every function, for every argument, by every compiler; and
compilers that would delete the checks are refused.
"""

import subprocess
from collections import Counter
from itertools import product

import pytest

from tests.support import zoo
from tests.support.rows import row
from tests.support.toolchains import clang

from .hostile import NOT_FINITE, NOT_POSITIVE_DEFINITE, OK, OUT_OF_RANGE, attacked

FAST = ("-O2", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-march=native")
# every form, real type, kind of tail and option; every compiler and level
QUICK = [("small", "gcc", ("-O1",)), ("bare", "gcc", ("-O0",))]
SLOW = [
    ("m1_n1", "gcc", ("-O0",)),
    ("ground_m1_n1", "clang", ("-O0",)),
    ("loops", "gcc", ("-O1",)),
    ("polar", "gcc", FAST),
    ("polar", "clang", ("-O3",)),
    ("bare", "gcc", ("-O3",)),
    ("arcs1", "clang", ("-O1",)),
    ("segments", "clang", FAST),
    ("small", "clang", ("-O2",)),
    ("small", "gcc", ("-O2",)),
    ("baked", "gcc", ("-O0",)),
]


@pytest.mark.parametrize(
    ("name", "compiler", "level"),
    [*QUICK, *(pytest.param(*case, marks=pytest.mark.slow) for case in SLOW)],
)
def test_status_ok_implies_finite_outputs(name, compiler, level):
    if compiler == "clang":
        clang()
    told, count, broken = Counter(), 0, []
    for call in attacked(name, compiler, level):
        count += 1
        told[call.status] += 1
        broken += [] if call.lawful else [call]
        assert call.put or call.status == OK, call  # what is ordinary is answered
    assert not broken, f"{len(broken)} of {count} calls, such as {broken[:5]}"
    assert count > 500 and {OK, NOT_FINITE, NOT_POSITIVE_DEFINITE} <= told.keys()
    assert (OUT_OF_RANGE in told) == (name in ("polar", "arcs1"))


def test_every_file_that_computes_refuses_fast_mathematics():
    clang()
    for name, parts in (("small", "*"), ("m1_n1", "*_flights")):
        folder = zoo.folder(name)
        sources = sorted((folder / "src").glob(f"{parts}.c"))
        assert len(sources) == (6 if parts == "*" else 1)
        flags = ("", "-ffast-math", "-Ofast", "-ffinite-math-only")
        for source, compiler, flag in product(sources, ("gcc", "clang"), flags):
            command = [compiler, "-std=c99", "-O2", *flag.split(), "-fsyntax-only", str(source)]
            command += ["-I", str(folder / "include")]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            with row(source.name, compiler, flag):
                refused = f"{name} checks for NaN and infinity" in done.stderr
                assert refused == (done.returncode != 0) == (flag != "")
                assert refused or done.stderr == ""

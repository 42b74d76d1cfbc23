"""The limits of the stress test follow from the arithmetic of the compiler."""

from pathlib import Path

import numpy as np

from stress import poses
from stress.subjects import errors, judged, roundings, state, subject


def test_coiled_tails_keep_the_limits_of_their_compiler():
    """Without optimisation the error of H is twice that of fused operations."""
    of, rng = subject(3, None), np.random.default_rng(2)
    coiled = {name: bends for name, bends in poses.folds(of).items() if "coiled" in name}
    assert len(coiled) == 2
    for name, bends in coiled.items():
        figures = judged(of, name, [errors(of, *state(of, rng, bends))])
        assert all(figure.passed for figure in figures), figures


def test_compilers_that_fuse_are_told_from_others(monkeypatch):
    quick = Path(__file__).parents[1] / "support" / "cc_quick"
    monkeypatch.setenv("CC", str(quick))
    assert roundings.__wrapped__() == 2
    monkeypatch.setenv("CC", "cc")
    if " fma " in Path("/proc/cpuinfo").read_text():
        assert roundings.__wrapped__() == 1

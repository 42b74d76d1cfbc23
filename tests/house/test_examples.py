"""The example that learns does what it says; those of the gallery have tests of their own."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

import serpentail as st
from examples import learning
from tests.support.models import model_folder
from tests.support.told import besides_progress


def test_learning_is_a_file_of_its_own(tmp_path):
    copy = shutil.copy(learning.__file__, tmp_path)
    done = subprocess.run(
        [sys.executable, "-P", copy, "--help"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    told = besides_progress(done.stderr)
    assert (done.returncode, told) == (0, "") and "A small policy learns" in done.stdout


@pytest.mark.slow
def test_a_policy_learns_to_right_the_rat(capsys):
    rat = st.load(model_folder(1, 3, functions=["forward_dynamics", "rollout"]))
    worlds = st.environments(rat, "righting", 512, step=2e-3, substeps=3)
    _, tilts = learning.learn(worlds, rounds=60)
    assert np.mean(tilts[:10]) > 35 and np.mean(tilts[-10:]) < 0.8 * np.mean(tilts[:10])
    assert "round  60: the backs are tilted by" in capsys.readouterr().out

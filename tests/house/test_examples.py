"""Examples do what they say."""

import re
import shutil
import subprocess
import sys

from examples import mpc
from tests.support.told import besides_progress


def test_predictive_control_rights_the_rat(capsys):
    mpc.main()
    tilts = [float(tilt) for tilt in re.findall(r"by +([\d.]+) deg", capsys.readouterr().out)]
    assert len(tilts) == 5 and tilts[0] > 30 and tilts[-1] < 1


def test_predictive_control_is_a_file_of_its_own(tmp_path):
    copy = shutil.copy(mpc.__file__, tmp_path)
    done = subprocess.run(
        [sys.executable, "-P", copy, "--help"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, besides_progress(done.stderr)) == (
        0,
        "",
    ) and "the tail rights" in done.stdout

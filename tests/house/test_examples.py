"""Examples do what they say."""

import re

from examples import mpc


def test_predictive_control_rights_the_rat(capsys):
    mpc.main()
    tilts = [float(tilt) for tilt in re.findall(r"by +([\d.]+) deg", capsys.readouterr().out)]
    assert len(tilts) == 5 and tilts[0] > 30 and tilts[-1] < 1

"""Studies and the example that learns: their models, figures and tables, of made-up rows."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

import serpentail as st
from examples import learning
from examples.studies import morphology_study as study
from examples.studies.righting_figures import draw_rates
from examples.studies.righting_kinds import WAYS, is_true, table
from tests.support import zoo


@pytest.mark.parametrize("taper", [0.1, 1.0])
def test_links_of_a_cone_are_those_of_its_integrals(taper):
    length, mass = 0.15, 0.004
    links = study.cone(length, mass, taper)
    base = np.sqrt(mass / (study.DENSITY * np.pi * length * (1 + taper + taper**2) / 3))

    def radius(s):
        return base * (1 - (1 - taper) * s / length)

    assert links["link_masses"].sum() == pytest.approx(mass, rel=1e-12)
    for k in range(study.LINKS):
        ends = k * length / study.LINKS, (k + 1) * length / study.LINKS

        def whole(f, ends=ends):
            return quad(lambda s: study.DENSITY * np.pi * f(s), *ends, epsabs=0, epsrel=1e-12)[0]

        own = whole(lambda s: radius(s) ** 2)
        center = whole(lambda s: radius(s) ** 2 * s) / own
        # of a disc of radius r about its axis r^2 / 2, about a diameter r^2 / 4, for each kilogram
        axial = whole(lambda s: radius(s) ** 4 / 2)
        across = whole(lambda s, c=center: radius(s) ** 2 * (radius(s) ** 2 / 4 + (s - c) ** 2))
        assert links["link_masses"][k] == pytest.approx(own, rel=1e-10)
        assert links["link_centers"][k] == pytest.approx(center - ends[0], rel=1e-8)
        found = links["link_inertias"][3 * k : 3 * k + 3]
        np.testing.assert_allclose(found, [across, axial, across], rtol=1e-9)


def test_tails_of_all_numbers_of_segments_take_the_links():
    links = study.cone(0.2, 0.005, 0.4)
    shape = {"tail": "articulated", "segments": 2, "links": study.LINKS // 2}
    model = st.build(**shape, taper=study.TAPERED, functions=["mass_matrix"], compiled=False)
    own = model.with_parameters(**links).parameters
    assert own["tail_mass"] == pytest.approx(0.005) and own["tail_length"] == pytest.approx(0.2)
    model_point = {"yaw": 0.1, "pitch": 2.0, "roll": -0.2, "pitch_rate": 12.0}
    q, v = study.start(model, model_point | {"other_rates": [1.0, -2.0]})
    turns = ([0, 0, 0.1], [2.0, 0, 0], [0, -0.2, 0])  # R = Rz(yaw) Rx(pitch) Ry(roll)
    z, x, y = (Rotation.from_rotvec(turn).as_matrix() for turn in turns)
    np.testing.assert_allclose(st.rotation_matrix(q[3:7]), z @ x @ y, atol=1e-12)
    np.testing.assert_array_equal(v[3:6], [12.0, 1.0, -2.0])


def solved(cpu_s, converged=True, error=1e-3):
    return {"cpu_s": cpu_s, "converged": converged, "open_loop_attitude_error_deg": error}


FAILED = solved(5.0, converged=False, error=np.nan)


def test_a_plan_is_true_if_it_converged_and_ends_where_it_should():
    assert is_true(solved(1.0)) and not is_true(solved(1.0, error=0.011))
    assert not is_true(solved(1.0, converged=False)) and not is_true(FAILED)


def test_rates_are_drawn_for_each_kind_however_few_have_a_plan(tmp_path):
    few = {"IPOPT": [solved(0.2), solved(0.1), solved(0.4, error=3.0), solved(0.3)]}
    few |= {"FATROP": [solved(0.1)] * 4, "paper": [solved(1.0, error=2.0)] * 4}
    rates = {"several": few, "none": {way: [FAILED] for way in WAYS}}
    _, (shares, times, errors) = draw_rates(rates, tmp_path / "rates.png")
    found = [line.get_xdata().tolist() for line in shares.get_lines()]
    assert found == [[75, 0], [100, 0], [0, 0]]
    np.testing.assert_allclose(times.get_lines()[0].get_xdata(), [0.25, 5.0])
    np.testing.assert_allclose(errors.get_lines()[2].get_xdata(), [2.0, np.nan])
    several, none = table(rates)[2:]
    assert several.startswith("| several | 4 | 3 | 0.25, 0.39 | ") and "nan" in none


@pytest.mark.slow
def test_a_policy_learns_to_right_the_rat(capsys):
    worlds = st.environments(zoo.model("m1_n3"), "righting", 512, step=2e-3, substeps=3)
    _, tilts = learning.learn(worlds, rounds=60)
    assert np.mean(tilts[:10]) > 35 and np.mean(tilts[-10:]) < 0.8 * np.mean(tilts[:10])
    assert "round  60: the backs are tilted by" in capsys.readouterr().out

"""The study of what a tail is worth: its cones, its starts, its figure."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

import serpentail as st
from examples.studies import morphology_study as study
from examples.studies.morphology_figures import draw


@pytest.mark.parametrize("taper", [0.1, 0.6, 1.0])
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


def test_figure_and_table_show_the_rows(tmp_path):
    random, rows = np.random.default_rng(1), []
    for segments in study.SEGMENTS:
        for _ in range(48):
            length = random.uniform(0.5, 1.5)
            row = {"segments": segments, "length": length, "mass": 1.0, "taper": 0.5}
            row |= {"righted": length > 1, "energy_J": length / 1e3, "duration_s": 0.5}
            rows.append(row)
    _, axes = draw(rows, tmp_path / "figure.png")
    shares = axes[0, 0].lines[0].get_ydata()
    assert shares[0] == 0 and shares[-1] == 100
    x, energy = axes[1, 0].lines[0].get_data()
    np.testing.assert_allclose(energy, x, atol=0.1)
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    lines = study.table(rows).splitlines()
    assert len(lines) == 2 + len(study.SEGMENTS) and "500 ms" in lines[-1]

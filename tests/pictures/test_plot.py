"""Laws of plots over time: the panels asked for, on the axes given, without what stays zero."""

import dataclasses

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.attitude import rotation_matrix
from serpentail.pictures.panels import PANELS, attitude
from serpentail.pictures.style import STYLE
from tests.support.drawn_flight import flight
from tests.support.rows import row


def labels(axes):
    return [each.get_ylabel().replace("\n", " ") for each in np.atleast_1d(axes)]


def curves(axes):
    """What a panel's lines are called, those that are drawn."""
    return {line.get_label(): line for line in axes.lines if len(line.get_xdata())}


def test_the_panels_that_are_named_in_their_order():
    figure, axes = flight().plot("tilt", "height", "tail")
    assert isinstance(figure, Figure) and list(figure.axes) == list(axes)
    told = ["tilt of the back [deg]", "height of torso [mm]", "bend of segment [deg]"]
    assert labels(axes) == told
    assert axes[-1].get_xlabel() == "time [s]"


def test_axes_that_are_given_are_drawn_on():
    figure = Figure()
    left, right = figure.subplots(1, 2)
    assert flight().plot("height", ax=left) == (figure, left)
    assert left.lines and not right.lines
    found, both = flight().plot("tail", "tilt", ax=[left, right])
    assert found is figure and both == [left, right] and right.lines


def test_what_cannot_be_plotted_is_refused(tmp_path):
    ax, path = Figure().subplots(), tmp_path / "a.png"
    for motion, panels, settings, words in (
        (flight(), ("tail", "hight"), {}, r"panels\[1\]: value 'hight'.*'height'"),
        (flight(), ("tail", "forces"), {}, r"panels\[1\]: value 'forces'.*'force'"),
        (flight(), (), {"ax": ax}, r"ax: 1 axes for \d+ panels"),
        (flight(), ("tail", "tilt"), {"ax": ax}, "ax: 1 axes for 2 panels"),
        (flight(), ("tail",), {"ax": ax, "path": path}, "path: "),
        (flight(samples=1), (), {"path": path}, "two"),
    ):
        with row(panels, settings), pytest.raises(st.ViewError, match=words):
            motion.plot(*panels, **settings)
    assert not list(tmp_path.iterdir())


def test_panels_that_stay_zero_are_left_out_unless_they_are_named():
    motion = dataclasses.replace(flight(), tau=np.zeros((59, 4)))
    assert not any("torque" in label for label in labels(motion.plot()[1]))
    assert any("torque" in label for label in labels(flight().plot()[1]))
    assert labels(motion.plot("torque")[1]) == ["tail torque [mN m]"]
    assert not any("force" in label for label in labels(flight().plot()[1]))
    assert len(flight(segments=0).plot()[1]) == len(PANELS) - 3  # no tail, no torque, no force


def test_curves_that_stay_zero_are_told_instead_of_drawn():
    """The flight is in the plane x = 0."""
    _, (axes,) = flight().plot("momentum")
    assert set(curves(axes)) == {"forward $y$", "up $z$"}
    told = [text.get_text() for text in axes.get_legend().get_texts()]
    assert told[-1] == "right $x$: 0"


@pytest.mark.parametrize("links", [1, 4])
def test_tails_are_shown_by_the_bends_of_their_segments(links):
    motion = flight()
    motion.model.links = links
    _, (axes,) = motion.plot("tail")
    for k, name in enumerate(("pitch 1", "yaw 1", "pitch 2", "yaw 2")):
        drawn = np.radians(curves(axes)[name].get_ydata())
        np.testing.assert_allclose(drawn, links * motion.tail[:, k])
    # the bend is the angle between the segment's ends: as many turns as there are links
    turn = Rotation.from_euler("x", motion.tail[5, 0]).as_matrix()
    whole = Rotation.from_matrix(np.linalg.matrix_power(turn, links)).as_rotvec()[0]
    assert np.radians(curves(axes)["pitch 1"].get_ydata()[5]) == pytest.approx(whole)


def test_without_a_model_the_tail_is_shown_by_its_coordinates():
    motion = dataclasses.replace(flight(), model=None)
    _, (axes,) = motion.plot("tail")
    assert labels(axes) == ["tail coord. [deg]"]
    np.testing.assert_allclose(
        np.radians(curves(axes)["yaw 2"].get_ydata()), motion.tail[:, 3], atol=1e-15
    )
    assert labels(motion.plot("tail", model=flight().model)[1]) == ["bend of segment [deg]"]


def tumbling():
    """A pitching torso that is rolled by a degree: near the vertical, roll and yaw jump."""
    motion = flight(samples=401)
    turn = Rotation.from_euler("YX", np.stack([0 * motion.t + 0.02, 20 * motion.t], axis=1))
    q = motion.q.copy()
    q[:, 3:7] = turn.as_quat()[:, [3, 0, 1, 2]]
    return dataclasses.replace(motion, q=q)


def test_angles_have_gaps_where_they_mean_little():
    motion = tumbling()
    angles = np.radians(attitude(motion, None).curves)
    upright = np.abs(rotation_matrix(motion.attitude)[:, 2, 1])  # sine of the pitch
    np.testing.assert_array_equal(np.isnan(angles[:, 1]), np.isnan(angles[:, 2]))
    assert np.isfinite(angles[:, 0]).all() and np.isnan(angles[upright > 0.99, 1]).all()
    assert np.isfinite(angles[upright < 0.98]).all()
    # what is drawn without a break is steady: no spikes
    steps = np.abs(np.diff(angles[:, 1:], axis=0))
    assert np.nanmax(steps) < np.radians(5)


def test_the_tilt_is_the_angle_of_the_back_to_the_vertical():
    motion = tumbling()
    _, (axes,) = motion.plot("tilt")
    wanted = np.degrees(np.arccos(rotation_matrix(motion.attitude)[:, 2, 2]))
    np.testing.assert_allclose(curves(axes)["tilt"].get_ydata(), wanted, atol=1e-5)


def test_everything_is_labelled_and_legends_cover_nothing():
    every = []
    with matplotlib.rc_context(STYLE):
        for segments in (0, 3, 8):
            figure, axes = flight(segments=segments).plot()
            figure.draw_without_rendering()
            every += list(axes)
    for axes in every:
        assert axes.get_ylabel().endswith("]")
        low, high = axes.get_ylim()
        lines = curves(axes).values()
        legend = axes.get_legend()
        if legend is None:
            assert len(lines) == 1
            continue
        box = legend.get_window_extent()
        assert axes.bbox.x0 <= box.x0 < box.x1 <= axes.bbox.x1
        bottom = axes.transData.inverted().transform((0, box.y0))[1]
        for line in lines:
            data = line.get_ydata()
            assert np.nanmin(data) >= low and np.nanmax(data) <= min(high, bottom)


def test_a_conserved_momentum_is_drawn_flat():
    constant = np.full((59, 3), 1e-3) * (1 + 1e-13 * np.eye(59, 3))
    _, (axes,) = dataclasses.replace(flight(), angular_momentum=constant).plot("angular_momentum")
    assert np.ptp(axes.get_ylim()) >= 0.01

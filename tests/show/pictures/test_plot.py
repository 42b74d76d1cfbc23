"""Plots over time; all figures have equal bytes twice, and leave global state alone."""

import dataclasses
import subprocess
import sys
from functools import partial
from itertools import product

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.basics.attitude import rotation_matrix
from serpentail.show.pictures.panels import PANELS, attitude
from serpentail.show.pictures.style import STYLE
from tests.support.drawn_flight import flight
from tests.support.rows import row

STARTS = {".pdf": b"%PDF-", ".png": b"\x89PNG", ".svg": b"<?xml"}
DRAWN = {
    "film": lambda motion, path: motion.filmstrip(path, frames=1, views=("side",)),
    "times": lambda motion, path: motion.plot("height", path=path),
}
OTHERS = {"font.size": 20, "axes.facecolor": "red", "svg.fonttype": "none", "xtick.color": "red"}


def labels(axes):
    return [each.get_ylabel().replace("\n", " ") for each in np.atleast_1d(axes)]


def curves(axes):
    """What a panel's lines are called, those that are drawn."""
    return {line.get_label(): line for line in axes.lines if len(line.get_xdata())}


def test_the_panels_that_are_named_in_their_order_on_axes_that_are_given():
    figure, axes = flight().plot("tilt", "height", "tail")
    assert list(figure.axes) == list(axes) and axes[-1].get_xlabel() == "time [s]"
    told = ["tilt of the back [deg]", "height of torso [mm]", "bend of segment [deg]"]
    assert labels(axes) == told
    figure = Figure()
    left, right = figure.subplots(1, 2)
    assert flight().plot("height", ax=left) == (figure, left) and not right.lines
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
    for draw, name in product(DRAWN.values(), ("film.gif", "film", "film.svgz")):
        with row(name), pytest.raises(ValueError, match=r"\.pdf, \.png, \.svg"):
            draw(flight(), tmp_path / "new" / name)
    assert not list(tmp_path.iterdir())


def test_panels_and_curves_that_stay_zero_are_left_out_unless_they_are_named():
    motion = dataclasses.replace(flight(), tau=np.zeros((59, 4)))
    assert not any("torque" in label for label in labels(motion.plot()[1]))
    assert any("torque" in label for label in labels(flight().plot()[1]))
    assert labels(motion.plot("torque")[1]) == ["tail torque [mN m]"]
    assert not any("force" in label for label in labels(flight().plot()[1]))
    assert len(flight(segments=0).plot()[1]) == len(PANELS) - 3  # no tail, no torque, no force
    # the flight is in the plane x = 0
    _, (axes,) = flight().plot("momentum")
    assert set(curves(axes)) == {"forward $y$", "up $z$"}
    assert axes.get_legend().get_texts()[-1].get_text() == "right $x$: 0"
    # what is conserved is drawn flat
    constant = np.full((59, 3), 1e-3) * (1 + 1e-13 * np.eye(59, 3))
    _, (axes,) = dataclasses.replace(flight(), angular_momentum=constant).plot("angular_momentum")
    assert np.ptp(axes.get_ylim()) >= 0.01


def test_tails_are_shown_by_the_bends_of_their_segments_or_without_a_model_by_their_coordinates():
    motion = flight()
    for links in (1, 4):  # the bend is the angle between the segment's ends
        motion.model.links = links
        _, (axes,) = motion.plot("tail")
        for k, name in enumerate(("pitch 1", "yaw 1", "pitch 2", "yaw 2")):
            drawn = np.radians(curves(axes)[name].get_ydata())
            np.testing.assert_allclose(drawn, links * motion.tail[:, k])
    motion = dataclasses.replace(flight(), model=None)
    _, (axes,) = motion.plot("tail")
    assert labels(axes) == ["tail coord. [deg]"]
    drawn = np.radians(curves(axes)["yaw 2"].get_ydata())
    np.testing.assert_allclose(drawn, motion.tail[:, 3], atol=1e-15)
    assert labels(motion.plot("tail", model=flight().model)[1]) == ["bend of segment [deg]"]


def test_angles_have_gaps_where_they_mean_little_and_the_tilt_has_none():
    """Of a pitching torso that is rolled by a degree: near the vertical, roll and yaw jump."""
    motion = flight(samples=401)
    turn = Rotation.from_euler("YX", np.stack([0 * motion.t + 0.02, 20 * motion.t], axis=1))
    q = motion.q.copy()
    q[:, 3:7] = turn.as_quat()[:, [3, 0, 1, 2]]
    motion = dataclasses.replace(motion, q=q)
    angles = np.radians(attitude(motion, None).curves)
    upright = np.abs(rotation_matrix(motion.attitude)[:, 2, 1])  # sine of the pitch
    np.testing.assert_array_equal(np.isnan(angles[:, 1]), np.isnan(angles[:, 2]))
    assert np.isfinite(angles[:, 0]).all() and np.isnan(angles[upright > 0.99, 1]).all()
    assert np.isfinite(angles[upright < 0.98]).all()
    # what is drawn without a break is steady: no spikes
    steps = np.abs(np.diff(angles[:, 1:], axis=0))
    assert np.nanmax(steps) < np.radians(5)
    # whereas the tilt is the angle of the back to the vertical
    _, (axes,) = motion.plot("tilt")
    wanted = np.degrees(np.arccos(rotation_matrix(motion.attitude)[:, 2, 2]))
    np.testing.assert_allclose(curves(axes)["tilt"].get_ydata(), wanted, atol=1e-5)


def test_runs_of_any_times_have_a_colour_each(tmp_path):
    """Of tails of one segment and of two; the first panel's legend has their names."""
    runs = {"one": flight(segments=1), "two": flight(segments=2, samples=31)}
    _, axes = st.plot(runs, "tilt", "tail", "momentum", path=tmp_path / "both.png")
    legends = [[text.get_text() for text in each.get_legend().get_texts()] for each in axes]
    assert legends[0] == ["one", "two"]
    assert set(legends[1]) == {"pitch", "yaw", "pitch 1", "pitch 2", "yaw 1", "yaw 2"}
    assert legends[2] == ["forward $y$", "up $z$", "right $x$: 0"] and len(curves(axes[2])) == 2
    drawn = [line for line in axes[0].lines if len(line.get_xdata())]
    for line, (name, run), key in zip(drawn, runs.items(), axes[0].lines[2:], strict=True):
        _, (alone,) = run.plot("tilt")
        x, y = line.get_data()
        with row(name):
            np.testing.assert_array_equal(x[np.isfinite(y)], run.t)
            np.testing.assert_array_equal(y[np.isfinite(y)], curves(alone)["tilt"].get_ydata())
            assert line.get_color() == key.get_color()
    assert drawn[0].get_color() != drawn[1].get_color()
    with pytest.raises(st.ViewError, match=r"motions\[1\]: type int"):
        st.plot([flight(), 1], "tilt")


def test_everything_is_labelled_and_legends_cover_nothing():
    every = []
    with matplotlib.rc_context(STYLE):
        for segments in (0, 3, 8):
            figure, axes = flight(segments=segments).plot()
            figure.draw_without_rendering()
            every += list(axes)
    for axes in every:
        assert axes.get_ylabel().endswith("]")
        lines, legend = [line.get_ydata() for line in curves(axes).values()], axes.get_legend()
        if legend is None:
            assert len(lines) == 1
            continue
        box, (low, high) = legend.get_window_extent(), axes.get_ylim()
        assert axes.bbox.x0 <= box.x0 < box.x1 <= axes.bbox.x1
        bottom = axes.transData.inverted().transform((0, box.y0))[1]
        assert np.nanmin(lines) >= low and np.nanmax(lines) <= min(high, bottom)


def test_figures_are_the_same_twice_in_every_format_whatever_the_user_has_set(tmp_path):
    for (name, draw), (suffix, start) in product(DRAWN.items(), STARTS.items()):
        first, second = (tmp_path / f"new {k}" / f"{name}{suffix}" for k in (1, 2))
        figure, axes = draw(flight(), first)
        assert first.read_bytes().startswith(start) and set(axes.ravel()) <= set(figure.axes)
        with matplotlib.rc_context(OTHERS):
            draw(flight(), second)
            assert matplotlib.rcParams["font.size"] == 20
        assert first.read_bytes() == second.read_bytes(), first.name
    assert len(list(tmp_path.glob("new*/*"))) == 2 * len(DRAWN) * len(STARTS)


def test_a_figure_keeps_its_look_until_it_is_saved(tmp_path):
    """Whoever saves it, with whatever settings: Matplotlib makes ticks when it draws."""
    few = partial(flight().filmstrip, frames=3, views=("top",))
    for draw in (flight().filmstrip, few, flight().plot):
        figures = [draw()[0] for _ in range(2)]
        figures[0].savefig(tmp_path / "a.png")
        with matplotlib.rc_context(OTHERS):
            figures[1].savefig(tmp_path / "b.png")
        assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert figures[0]._repr_png_().startswith(STARTS[".png"])


def test_drawing_leaves_pyplot_alone_and_importing_leaves_matplotlib_alone(tmp_path):
    code = (
        "import sys, serpentail.show.pictures.film, serpentail.show.pictures.filmstrip, "
        "serpentail.show.pictures.plot, serpentail.motion.trajectory\n"
        "assert not {'matplotlib', 'scipy', 'PIL'} & set(sys.modules)\n"
        "from tests.support.drawn_flight import flight\n"
        "folder = sys.argv[1]\n"
        "flight().filmstrip(f'{folder}/film.svg', frames=1)\n"
        "flight().plot('tilt', path=f'{folder}/times.svg')\n"
        "flight().film(f'{folder}/film.gif', speed=9.0)\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path], check=True)

"""Laws of the figures: true silhouettes and visibility, equal scales, nothing hidden, equal bytes
twice.
"""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from serpentail.pictures import filmstrip as film
from serpentail.pictures import time_plots as plots
from serpentail.pictures.animal import SIDE, TOP, Body
from serpentail.pictures.filmstrip import filmstrip
from serpentail.pictures.style import STYLE
from serpentail.pictures.time_plots import time_plots
from tests.support.drawn_flight import SPEEDS, flight, tail_points

STARTS = {".pdf": b"%PDF-", ".png": b"\x89PNG", ".svg": b"<?xml"}


def drawn_film(trajectory, frames=8, com=None):
    """The film's figure and frames, unwritten."""
    com = trajectory.q[:, :3] if com is None else com
    points, moments = tail_points(trajectory), film._moments(trajectory.t, frames)
    body = Body()
    frames = [film._frame(trajectory, points, com, body, k) for k in moments]
    return film._draw_film(frames, com), frames


@pytest.mark.parametrize("suffix", STARTS)
@pytest.mark.parametrize(
    "speed", ["up", *(pytest.param(name, marks=pytest.mark.slow) for name in ("far", "still"))]
)
def test_figures_are_written_in_every_format(tmp_path, suffix, speed):
    trajectory = flight(SPEEDS[speed])
    path = tmp_path / "new" / f"film{suffix}"
    assert filmstrip(trajectory, tail_points(trajectory), path) == path
    assert path.read_bytes().startswith(STARTS[suffix])
    assert time_plots(trajectory, str(tmp_path / f"times{suffix}")) == tmp_path / f"times{suffix}"
    assert (tmp_path / f"times{suffix}").read_bytes().startswith(STARTS[suffix])
    assert sorted(p.name for p in tmp_path.rglob("*.*")) == [f"film{suffix}", f"times{suffix}"]


@pytest.mark.parametrize(
    "suffix", [".svg", *(pytest.param(s, marks=pytest.mark.slow) for s in (".pdf", ".png"))]
)
def test_the_same_bytes_twice_whatever_the_user_has_set(tmp_path, suffix):
    trajectory = flight()
    points = tail_points(trajectory)
    filmstrip(trajectory, points, tmp_path / f"film1{suffix}")
    time_plots(trajectory, tmp_path / f"times1{suffix}")
    with matplotlib.rc_context({"font.size": 20, "axes.facecolor": "red", "svg.fonttype": "none"}):
        filmstrip(trajectory, points, tmp_path / f"film2{suffix}")
        time_plots(trajectory, tmp_path / f"times2{suffix}")
        assert matplotlib.rcParams["font.size"] == 20
    for name in ("film", "times"):
        first, second = (tmp_path / f"{name}{k}{suffix}" for k in (1, 2))
        assert first.read_bytes() == second.read_bytes()


def test_drawing_leaves_pyplot_alone_and_importing_leaves_matplotlib_alone(tmp_path):
    code = (
        "import sys, serpentail.pictures.filmstrip, serpentail.pictures.time_plots, "
        "serpentail.motion.trajectory\n"
        "assert 'matplotlib' not in sys.modules and 'scipy' not in sys.modules\n"
        "from tests.support.drawn_flight import flight, tail_points\n"
        "serpentail.pictures.filmstrip.filmstrip(flight(), tail_points(flight()), 'film.svg')\n"
        "serpentail.pictures.time_plots.time_plots(flight(), 'times.svg')\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    packages = [str(Path(plots.__file__).parents[2]), str(Path(__file__).parents[2])]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(packages),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)


def test_a_failed_drawing_leaves_the_old_file(tmp_path, monkeypatch):
    path = time_plots(flight(), tmp_path / "times.svg")
    before = path.read_bytes()

    def cut_short(figure, stream, **options):
        stream.write(b"half")
        raise OSError("no space left")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", cut_short)
    with pytest.raises(OSError, match="no space left"):
        time_plots(flight(samples=20), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["film.gif", "film", "film.svgz"])
def test_unknown_suffix_lists_the_known(tmp_path, name):
    for draw in (
        lambda path: filmstrip(flight(), tail_points(flight()), path),
        lambda path: time_plots(flight(), path),
    ):
        with pytest.raises(ValueError, match=r"use one of \.pdf, \.png, \.svg"):
            draw(tmp_path / "new" / name)
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.zeros((58, 9, 3))}, r"points has shape \(58, 9, 3\): give \(59, P, 3\)"),
        ({"points": np.zeros((59, 9))}, r"points has shape \(59, 9\): give"),
        ({"points": np.zeros((59, 0, 3))}, r"points has shape \(59, 0, 3\): give"),
        (
            {"points": np.full((59, 9, 3), np.nan)},
            r"points \(59, 9, 3\) has values that are not finite",
        ),
        ({"com": np.zeros(3)}, r"com has shape \(3,\): give \(59, 3\)"),
        ({"frames": 0}, "frames is 0: give a whole number"),
        ({"frames": 2.5}, "frames is 2.5: give a whole number"),
        ({"semi_axes": (1, 2)}, r"semi_axes is \(1, 2\): give three"),
        ({"semi_axes": (1, 0, 1)}, r"semi_axes is \(1, 0, 1\): give positive"),
        ({"tail_mount": (np.inf, 0, 0)}, "tail_mount is .*: give three finite"),
    ],
)
def test_bad_input_is_named_with_a_remedy(tmp_path, change, message):
    given = {"points": tail_points(flight())} | change
    with pytest.raises(ValueError, match=message):
        filmstrip(flight(), path=tmp_path / "film.svg", **given)
    assert not list(tmp_path.iterdir())


def test_unknown_option_is_an_error(tmp_path):
    with pytest.raises(TypeError, match="semi_axis"):
        filmstrip(flight(), tail_points(flight()), tmp_path / "film.svg", semi_axis=(1, 1, 1))


def test_one_sample_cannot_be_drawn_over_time(tmp_path):
    with pytest.raises(ValueError, match="give at least two"):
        time_plots(flight(samples=1), tmp_path / "times.svg")


@pytest.mark.parametrize("frames", [1, 2, 7, 8, 40])
def test_frames_are_the_samples_nearest_to_even_times(frames):
    t = np.sort(np.random.default_rng(5).uniform(0, 1, 400))
    moments = film._moments(t, frames)
    assert len(moments) == frames
    assert np.abs(t[moments] - np.linspace(t[0], t[-1], frames)).max() <= np.diff(t).max() / 2
    assert film._moments(t[:3], 8) == [0, 1, 2]


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("frames", [1, 3, pytest.param(13, marks=pytest.mark.slow)])
def test_panels_have_one_scale_and_show_everything(speed, frames):
    figure, film = drawn_film(flight(SPEEDS[speed]), frames)
    width, height = figure.get_size_inches()
    panels = [axes for axes in figure.axes if axes.axison]
    assert len(panels) == 2 * frames + (speed != "still")
    scales = []
    for axes in panels:
        place, (x, y) = axes.get_position(), (np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim()))
        scales.append((place.width * width / x, place.height * height / y))
        assert place.x0 > 0 < place.y0
        assert place.x1 < 1 > place.y1
    np.testing.assert_allclose(*np.transpose(scales), rtol=2e-3)
    np.testing.assert_allclose(scales[: 2 * frames], scales[0][0], rtol=2e-3)
    for k, frame in enumerate(film):
        for axes, view in ((panels[k], SIDE), (panels[frames + k], TOP)):
            shown = (
                np.vstack([frame.outline(view), view.of(frame.tail)[:, :2]])
                - view.of(frame.com)[:2]
            )
            assert (shown > [axes.get_xlim()[0], axes.get_ylim()[0]]).all()
            assert (shown < [axes.get_xlim()[1], axes.get_ylim()[1]]).all()


@pytest.mark.parametrize("frames", [1, 4, pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("speed", SPEEDS)
def test_panels_key_and_labels_do_not_overlap(speed, frames):
    with matplotlib.rc_context(STYLE):
        figure, _ = drawn_film(flight(SPEEDS[speed]), frames)
        figure.draw_without_rendering()
        boxes = [axes.get_tightbbox() for axes in figure.axes if axes.axison]
        boxes.append(figure.legends[0].get_window_extent())
    for k, box in enumerate(boxes):
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1
        for other in boxes[:k]:
            shared = matplotlib.transforms.Bbox.intersection(box, other)
            assert shared is None or min(shared.width, shared.height) < 2


def test_centre_of_mass_given_moves_the_windows():
    trajectory = flight()
    com = trajectory.q[:, :3] + [0, -0.1, 0.02]
    (plain, _), (moved, _) = drawn_film(trajectory), drawn_film(trajectory, com=com)
    np.testing.assert_allclose(
        np.subtract(moved.axes[0].get_xlim(), plain.axes[0].get_xlim()), 0.1, atol=1e-12
    )


@pytest.mark.parametrize(
    "segments", [0, 3, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 8))]
)
def test_time_plots_label_everything_and_legends_cover_nothing(segments):
    with matplotlib.rc_context(STYLE):
        figure = plots._draw_times(flight(segments=segments))
        figure.draw_without_rendering()
        curves = 15 + 4 * segments
        assert sum(len(axes.lines) for axes in figure.axes) == curves
        for axes in figure.axes:
            assert axes.get_ylabel().endswith("]")
            assert len(axes.get_legend().get_texts()) == len(axes.lines)
            legend = axes.get_legend().get_window_extent()
            assert legend.x0 >= axes.bbox.x1
            assert legend.x1 <= figure.bbox.x1
            for line in axes.lines:
                assert line.get_ydata().min() >= axes.get_ylim()[0]
                assert line.get_ydata().max() <= axes.get_ylim()[1]


def test_a_conserved_momentum_is_drawn_flat():
    trajectory = dataclasses.replace(
        flight(), angular_momentum=np.full((59, 3), 1e-3) * (1 + 1e-13 * np.eye(59, 3))
    )
    figure = plots._draw_times(trajectory)
    assert np.ptp(figure.axes[-1].get_ylim()) >= 0.01

"""Laws of filmstrips: equal scales, nothing hidden, moments that differ, ground where there is
some.
"""

import dataclasses
from itertools import product

import matplotlib
import numpy as np
import pytest
from PIL import Image

import serpentail as st
from serpentail.pictures.filmstrip import strip_of
from serpentail.pictures.frames import moments, way
from serpentail.pictures.page import drawn_points
from serpentail.pictures.style import STYLE
from serpentail.pictures.views import NAMED, SIDE, views_of
from tests.support.drawn_flight import SPEEDS, flight
from tests.support.rows import row

VIEWS = ("side", "top", "oblique")


def lifted(motion, height):
    """The motion higher above the ground."""
    q = motion.q.copy()
    q[:, 2] += height
    return dataclasses.replace(motion, q=q)


def panels_of(figure, axes):
    """The panels, that of the path too."""
    return [each for each in figure.axes if each in set(axes.ravel()) or each.get_xlabel()]


def check_scales(figure, axes, motion, frames):
    """Panels have one scale, lie on the page and show everything."""
    assert axes.shape == (3, frames)
    width, tall = figure.get_size_inches()
    scales = []
    for each in panels_of(figure, axes):
        place, (x, y) = each.get_position(), (np.ptp(each.get_xlim()), np.ptp(each.get_ylim()))
        scales.append((place.width * width / x, place.height * tall / y))
        assert place.x0 > 0 < place.y0 and place.x1 < 1 > place.y1
    np.testing.assert_allclose(*np.transpose(scales), rtol=2e-3)
    np.testing.assert_allclose(scales[: 3 * frames], scales[0][0], rtol=2e-3)
    strip = strip_of([motion], frames, views_of(VIEWS), None, None)
    for k, frame in enumerate(strip.films[0]):
        for line, name in enumerate(VIEWS):
            view = NAMED[name]
            shown = drawn_points(frame, view) - view.of(strip.origin(frame))[:2]
            low, high = np.transpose([axes[line, k].get_xlim(), axes[line, k].get_ylim()])
            assert (shown > low).all() and (shown < high).all()


def check_overlaps(figure, axes):
    """Panels, key and labels do not overlap, and lie on the page."""
    figure.draw_without_rendering()
    boxes = [each.get_tightbbox() for each in panels_of(figure, axes)]
    boxes.append(figure.legends[0].get_window_extent())
    for k, box in enumerate(boxes):
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1
        for other in boxes[:k]:
            shared = matplotlib.transforms.Bbox.intersection(box, other)
            assert shared is None or min(shared.width, shared.height) < 2


FEW = [("up", 3, 0.0), ("far", 1, 0.4), ("still", 4, 50.0), ("far", 3, 0.0)]
MANY = product(SPEEDS, (1, 4, 13), (0.0, 0.4, 50.0))


@pytest.mark.parametrize("pages", [FEW, pytest.param(list(MANY), marks=pytest.mark.slow)])
def test_panels_have_one_scale_show_everything_and_do_not_overlap(pages):
    for speed, frames, height in pages:
        motion = lifted(flight(SPEEDS[speed]), height)
        with row(speed, frames, height), matplotlib.rc_context(STYLE):
            figure, axes = motion.filmstrip(frames=frames, views=VIEWS)
            check_scales(figure, axes, motion, frames)
            check_overlaps(*motion.filmstrip(frames=frames))


def test_joints_leave_the_tail_s_colour_in_sight(tmp_path):
    """Of 4, 12 and 20 links of a tail of one length: dots in ink on a line in vermilion."""
    seen = []
    for segments in (1, 3, 5):
        motion = flight(SPEEDS["still"], segments=segments)
        motion.filmstrip(tmp_path / "strip.png", frames=1, views=("side",))
        pixels = np.asarray(Image.open(tmp_path / "strip.png").convert("RGB"), int)
        animal = pixels[: int(0.8 * len(pixels))]  # above the key
        seen.append((np.abs(animal - [0xD5, 0x5E, 0x00]).max(axis=2) < 12).sum())
    assert min(seen) > 0.8 * seen[0] > 0


def test_motions_are_rows_at_the_same_times():
    one, other = flight(), flight(SPEEDS["far"], samples=200)
    figure, axes = st.filmstrip([one, other], frames=5, views=("side", "top"), names=["a", "b"])
    assert axes.shape == (4, 5)
    told = {text.get_text() for each in figure.axes for text in each.texts}
    assert {"a", "b", "side", "top", "$x$", "$y$", "$z$"} <= told
    films = strip_of([one, other], 5, [SIDE], ["a", "b"], None).films
    for first, second in zip(*films, strict=True):
        assert abs(first.time - second.time) < np.diff(one.t).max() / 2


def test_moments_do_not_repeat_what_rests():
    """It rests for most of the time, then moves: as a kick, whose first frames were alike."""
    t = np.linspace(0, 1.2, 1201)
    gone = np.clip(t - 0.4, 0, 0.6)
    for count in (2, 5, 8):
        times = moments([(t, gone)], count)
        assert times[0] == 0 and times[-1] == pytest.approx(1.2) and len(times) == count
        assert ((times > 0) & (times < 0.4)).sum() <= count // 8
        even = np.linspace(0, 1.2, count)
        np.testing.assert_allclose(moments([(t, 0 * t)], count), even, atol=1e-3)


def test_the_way_is_that_of_the_drawn_points():
    """A torso that slides 1 m and back has gone 2 m."""
    motion = flight(SPEEDS["still"], segments=0, samples=101)
    q = motion.q.copy()
    q[:, 3:7] = 1, 0, 0, 0
    q[:, 1] = 0.5 - np.abs(np.linspace(-1, 1, 101)) / 2
    gone = way(motion.model, dataclasses.replace(motion, q=2 * q - q * (np.arange(7) > 2)))
    assert gone[0] == 0 and gone[-1] == pytest.approx(2) and (np.diff(gone) > 0).all()


def test_frames_are_the_samples_nearest_to_wanted_times():
    motion = flight()
    (film,) = strip_of([motion], [0.31, 0.0, 0.1], [SIDE], None, None).films
    assert [frame.time for frame in film] == [
        motion.t[np.abs(motion.t - t).argmin()] for t in (0.0, 0.1, 0.31)
    ]
    few = dataclasses.replace(flight(samples=3))
    assert len(strip_of([few], 8, [SIDE], None, None).films[0]) == 3


def test_ground_is_drawn_below_what_stays_above_it():
    for height, grounded, anchored in ((-0.5, False, False), (0.4, True, True), (50, True, False)):
        strip = strip_of([lifted(flight(), height)], 4, [SIDE], None, None)
        assert (strip.grounded, strip.anchored) == (grounded, anchored)
        for frame in strip.films[0]:
            ground = -SIDE.of(strip.origin(frame))[1]
            low, high = strip.windows()[0][:, 1]
            assert not anchored or low < ground < high


def test_wrong_arguments_are_named(tmp_path):
    for change, words in (
        ({"frames": 0}, "frames: value 0:"),
        ({"frames": 2.5}, r"frames: value 2\.5:"),
        ({"frames": True}, "frames: value True:"),
        ({"frames": [0.1, np.nan]}, "frames: value"),
        ({"names": ["a", "b"]}, "names: value .* 1 names"),
    ):
        with row(change), pytest.raises(st.ViewError, match=words):
            flight().filmstrip(tmp_path / "film.svg", **change)
    assert not list(tmp_path.iterdir())
    loaded = st.Trajectory.load(flight().save(tmp_path / "a.npz"))
    for draw in (loaded.filmstrip, lambda: loaded.film(tmp_path / "a.gif")):
        with pytest.raises(st.ViewError, match="model=st"):
            draw()
    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]

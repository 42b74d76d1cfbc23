"""Filmstrips: equal scales, nothing hidden, moments that differ, ground where there is some."""

import dataclasses
from itertools import product

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

import serpentail as st
from serpentail.show.pictures.frames import drawn_points
from serpentail.show.pictures.pen import PALE
from serpentail.show.pictures.strip import moments, strip_of, way_of
from serpentail.show.pictures.style import INK, SHADOW, STYLE, TORSO
from serpentail.show.pictures.views import NAMED, SIDE, views_of
from tests.support import zoo
from tests.support.drawn_flight import SPEEDS, flight
from tests.support.rows import row

VIEWS = ("side", "top", "oblique")
GROUPS = {"feet": 6, "tail": 3, "torso": 1}
WEIGHT, BLOW = 0.2, 20.0  # N, of a point
EVENTS = [
    {"time": 0.1, "group": "feet", "kind": "take_off"},
    {"time": 0.11, "group": "tail", "kind": "take_off"},
    {"time": 0.5, "group": "feet", "kind": "touch_down"},
]


def lifted(motion, height):
    """The motion higher above the ground."""
    return dataclasses.replace(motion, q=motion.q + height * np.eye(motion.q.shape[1])[2])


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
    np.testing.assert_allclose(*np.transpose(scales), rtol=2e-3)
    np.testing.assert_allclose(scales[: 3 * frames], scales[0][0], rtol=2e-3)
    strip = strip_of([motion], frames, views_of(VIEWS), None, None)
    for k, frame in enumerate(strip.films[0]):
        for line, name in enumerate(VIEWS):
            view = NAMED[name]
            shown = drawn_points(frame, view) - view.of(strip.origin(frame))[:2]
            low, high = np.transpose([axes[line, k].get_xlim(), axes[line, k].get_ylim()])
            assert (shown > low).all() and (shown < high).all()


def inside(box, page):
    return page.x0 <= box.x0 < box.x1 <= page.x1 and page.y0 <= box.y0 < box.y1 <= page.y1


def check_overlaps(figure, axes):
    """Panels, key and labels do not overlap, and lie on the page."""
    figure.draw_without_rendering()
    boxes = [each.get_tightbbox() for each in panels_of(figure, axes)]
    boxes.append(figure.legends[0].get_window_extent())
    for k, box in enumerate(boxes):
        assert inside(box, figure.bbox)
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
    # those nearest to wanted times
    (film,) = strip_of([one], [0.31, 0.0, 0.1], [SIDE], None, None).films
    nearest = [one.t[np.abs(one.t - t).argmin()] for t in (0.0, 0.1, 0.31)]
    assert [frame.time for frame in film] == nearest
    assert len(strip_of([flight(samples=3)], 8, [SIDE], None, None).films[0]) == 3


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
    # the way is that of the drawn points: a torso that slides 1 m and back has gone 2 m
    motion = flight(SPEEDS["still"], segments=0, samples=101)
    q = motion.q.copy()
    q[:, 3:7] = 1, 0, 0, 0
    q[:, 1] = 0.5 - np.abs(np.linspace(-1, 1, 101)) / 2
    gone = way_of(motion.model, dataclasses.replace(motion, q=2 * q - q * (np.arange(7) > 2)))
    assert gone[0] == 0 and gone[-1] == pytest.approx(2) and (np.diff(gone) > 0).all()


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


# On the ground.


def standing(height=0.0, legs=False):
    """The flight as if it had stood, with one blow."""
    motion, count = flight(), sum(GROUPS.values())
    shape = (len(motion.t), count, 3)
    points = np.random.default_rng(3).uniform(-0.1, 0.1, shape)
    forces = np.broadcast_to([0, 0, WEIGHT], shape).copy()
    forces[len(motion.t) // 2, :, 2] = BLOW
    angles = np.zeros((len(motion.t), 4)) if legs else None
    contact = st.Contact(points, forces, np.zeros((*shape[:2], 2)), GROUPS, angles)
    if legs:
        motion.model.kernels["leg_points"] = None
        motion.model.leg_points = lambda q, _: q[:, None, None, :3] + np.zeros((1, 2, 6, 1))
    q = motion.q + height * (np.arange(motion.q.shape[1]) == 2)
    info = {"events": EVENTS}
    return dataclasses.replace(motion, q=q, contact=contact, info=info, model=motion.model)


def test_the_key_has_every_mark_and_lies_on_the_page():
    for frames, legs in ((1, True), (4, False), (8, True)):
        with matplotlib.rc_context(STYLE):
            found, _ = standing(legs=legs).filmstrip(frames=frames)
            found.draw_without_rendering()
        assert inside(found.legends[0].get_window_extent(), found.bbox)
        told = [text.get_text() for text in found.legends[0].get_texts()]
        assert len(told) == 7 + legs and ("leg" in told) == legs
        assert told[-1] == "below the ground" and told[-2].startswith("force, 60 mm: ")
    above = standing(height=1.0).filmstrip(frames=1)[0].legends[0].get_texts()
    assert "below the ground" not in [text.get_text() for text in above]
    tail = st.simulate(zoo.model("fixed"), np.full(4, 0.3), np.zeros(4), t_span=0.1)
    told = tail.filmstrip(frames=1)[0].legends[0].get_texts()
    assert [text.get_text() for text in told] == ["tail"]


def faces(axes, colour):
    """Filled outlines of a colour."""
    return [each for each in axes.patches if each.get_facecolor()[:3] == to_rgb(colour)]


def test_what_is_below_the_ground_is_pale_and_shadows_lie_where_one_looks_down():
    """The torso half in the ground: all of it pale, and its upper part over that."""
    for view, lies in (("side", False), ("oblique", True), ("top", True)):
        ((axes,),) = standing(height=0.3).filmstrip(frames=[0.0], views=(view,))[1]
        assert bool(faces(axes, SHADOW)) == lies, view
        if view == "top":  # the tail's, too
            first = {line.get_color(): line.get_xydata() for line in axes.lines[::-1]}
            np.testing.assert_allclose(first[SHADOW], first[INK])
        ((axes,),) = standing(height=-0.06).filmstrip(frames=[0.0], views=(view,))[1]
        whole, part = faces(axes, TORSO)
        assert (whole.get_facecolor()[3], part.get_facecolor()[3]) == (PALE, 1)
        sizes = [np.ptp(each.get_xy(), axis=0) for each in (whole, part)]
        assert (sizes[1] <= sizes[0] + 1e-9).all()
        for line in axes.lines:
            if line.get_alpha() is None and view == "side" and line.get_linewidth() == 1.4:
                assert np.nanmin(line.get_ydata(), initial=0) >= 0
        assert any(line.get_alpha() == PALE for line in axes.lines)


def test_arrows_are_the_forces():
    motion = standing()
    _, axes = motion.filmstrip(frames=[0.0, float(motion.t[29])], views=("side",))
    for panel, size in zip(axes[0], (np.sqrt(WEIGHT / BLOW), 1), strict=True):
        (arrows,) = [each for each in panel.collections if hasattr(each, "U")]
        np.testing.assert_allclose(np.hypot(arrows.U, arrows.V), 0.06 * size)
        assert len(arrows.U) == sum(GROUPS.values())


def test_plots_have_forces_on_a_linear_axis_and_events_on_every_panel():
    figure, every = standing().plot()
    (axes,) = [axes for axes in figure.axes if axes.get_ylabel().startswith("normal force")]
    for line, count in zip(axes.lines, GROUPS.values(), strict=True):
        drawn = line.get_ydata().min(), line.get_ydata().max()
        assert drawn == pytest.approx((count * WEIGHT, count * BLOW))
    assert {each.get_yscale() for each in every} == {"linear"}
    _, every = standing().plot("height", "force", "tail")
    for axes in every:
        lines = {each.get_label(): each for each in axes.collections}
        for kind in ("take_off", "touch_down"):
            drawn = [segment[0, 0] for segment in lines[f"_{kind}"].get_segments()]
            assert drawn == [event["time"] for event in EVENTS if event["kind"] == kind]
    assert [text.get_text() for text in every[0].texts] == ["feet off", "feet on", "tail off"]
    # of events close to each other the feet's have the first place, the torso's the second row
    times = (("tail", 0.1), ("feet", 0.102), ("torso", 0.101), ("tail", 0.5))
    events = [{"time": time, "group": group, "kind": "take_off"} for group, time in times]
    motion = standing()
    span = np.ptp(motion.t)
    for event in events:
        event["time"] = motion.t[0] + event["time"] * span
    _, axes = dataclasses.replace(motion, info={"events": events}).plot("height")
    places = {text.get_text(): text.get_position()[1] for text in axes[0].texts}
    assert list(places) == ["feet off", "torso off", "tail off"]
    assert places["torso off"] > places["feet off"] == places["tail off"]
    # where events are unknown there are none
    _, axes = dataclasses.replace(standing(), info={"method": "dop853"}).plot("height")
    assert not axes[0].collections and not axes[0].texts

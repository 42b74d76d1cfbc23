"""Laws of the pictures of motions on the ground: the key fits, ground and what is below it."""

import dataclasses

import matplotlib
import numpy as np
import pytest

import serpentail as st
from serpentail.pictures.animal import PALE, SHADOW
from serpentail.pictures.style import STYLE, TORSO
from tests.support.drawn_flight import flight

GROUPS = {"feet": 6, "tail": 3, "torso": 1}
WEIGHT, BLOW = 0.2, 20.0  # N, of a point
EVENTS = [
    {"time": 0.1, "group": "feet", "kind": "take_off"},
    {"time": 0.11, "group": "tail", "kind": "take_off"},
    {"time": 0.5, "group": "feet", "kind": "touch_down"},
]


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


def marks(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_key_has_every_mark_and_lies_on_the_page():
    for frames, legs in ((1, True), (4, False), (8, True)):
        with matplotlib.rc_context(STYLE):
            found, _ = standing(legs=legs).filmstrip(frames=frames)
            found.draw_without_rendering()
        box = found.legends[0].get_window_extent()
        assert found.bbox.x0 <= box.x0 < box.x1 <= found.bbox.x1
        assert found.bbox.y0 <= box.y0 < box.y1 <= found.bbox.y1
        told = marks(found)
        assert len(told) == 7 + legs and ("leg" in told) == legs
        assert told[-1] == "below the ground" and told[-2].startswith("force, 60 mm: ")
    assert "below the ground" not in marks(standing(height=1.0).filmstrip(frames=1)[0])


def faces(axes, colour):
    """Filled outlines of a colour: how opaque each is, and its corners."""
    wanted = matplotlib.colors.to_rgb(colour)
    patches = [each for each in axes.patches if each.get_facecolor()[:3] == wanted]
    return [(each.get_facecolor()[3], each.get_xy()) for each in patches]


def test_what_is_below_the_ground_is_pale():
    """The torso half in the ground: all of it pale, and its upper part over that."""
    for view in ("side", "oblique", "top"):
        _, axes = standing(height=-0.06).filmstrip(frames=[0.0], views=(view,))
        (whole, outline), (part, above) = faces(axes[0, 0], TORSO)
        assert whole == PALE and part == 1
        assert (np.ptp(above, axis=0) <= np.ptp(outline, axis=0) + 1e-9).all()
        for line in axes[0, 0].lines:
            if line.get_alpha() is None and view == "side" and line.get_linewidth() == 1.4:
                assert np.nanmin(line.get_ydata(), initial=0) >= 0
        assert any(line.get_alpha() == PALE for line in axes[0, 0].lines)


def test_shadows_lie_where_one_looks_down():
    for view, lies in (("side", False), ("oblique", True), ("top", True)):
        _, axes = standing(height=0.3).filmstrip(frames=[0.0], views=(view,))
        assert bool(faces(axes[0, 0], SHADOW)) == lies, view


def test_arrows_are_the_forces():
    motion = standing()
    _, axes = motion.filmstrip(frames=[0.0, float(motion.t[29])], views=("side",))
    for panel, size in zip(axes[0], (np.sqrt(WEIGHT / BLOW), 1), strict=True):
        (arrows,) = [each for each in panel.collections if hasattr(each, "U")]
        np.testing.assert_allclose(np.hypot(arrows.U, arrows.V), 0.06 * size)
        assert len(arrows.U) == sum(GROUPS.values())


# Plots.


def axes_of(figure, label):
    (axes,) = [axes for axes in figure.axes if axes.get_ylabel().startswith(label)]
    return axes


def test_forces_are_drawn_on_a_linear_axis():
    figure, every = standing().plot()
    axes = axes_of(figure, "normal force")
    for line, count in zip(axes.lines, GROUPS.values(), strict=True):
        drawn = line.get_ydata().min(), line.get_ydata().max()
        assert drawn == pytest.approx((count * WEIGHT, count * BLOW))
    assert {each.get_yscale() for each in every} == {"linear"}


def test_events_are_lines_on_every_panel_and_told_above_the_first():
    _, every = standing().plot("height", "force", "tail")
    for axes in every:
        lines = {each.get_label(): each for each in axes.collections}
        for kind in ("take_off", "touch_down"):
            drawn = [segment[0, 0] for segment in lines[f"_{kind}"].get_segments()]
            assert drawn == [event["time"] for event in EVENTS if event["kind"] == kind]
    assert [text.get_text() for text in every[0].texts] == ["feet off", "feet on"]
    # where events are unknown there are none
    _, axes = dataclasses.replace(standing(), info={"method": "dop853"}).plot("height")
    assert not axes[0].collections and not axes[0].texts

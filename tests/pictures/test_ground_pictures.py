"""Laws of the figures of motions on the ground: the key fits, blows and weights are both seen."""

import dataclasses

import matplotlib
import numpy as np
import pytest

import serpentail as st
from serpentail.pictures import filmstrip as film
from serpentail.pictures import time_plots as plots
from serpentail.pictures.style import STYLE
from tests.support.drawn_flight import flight, tail_points

GROUPS = {"feet": 6, "tail": 3, "torso": 1}
WEIGHT, BLOW = 0.2, 20.0  # N, of a point


@pytest.fixture
def figure(monkeypatch):
    """Return a function that draws instead of writing."""
    for module in (film, plots):
        monkeypatch.setattr(module, "write", lambda path, draw: draw())

    def drawn(draw, *arguments, **options):
        with matplotlib.rc_context(STYLE):
            found = draw(*arguments, "a.svg", **options)
            found.draw_without_rendering()
        return found

    return drawn


def standing():
    """The flight as if it had stood, with one blow."""
    motion, count = flight(), sum(GROUPS.values())
    shape = (len(motion.t), count, 3)
    points = np.random.default_rng(3).uniform(-0.1, 0.1, shape)
    forces = np.broadcast_to([0, 0, WEIGHT], shape).copy()
    forces[len(motion.t) // 2, :, 2] = BLOW
    contact = st.Contact(points, forces, np.zeros((*shape[:2], 2)), GROUPS)
    return dataclasses.replace(motion, contact=contact)


@pytest.mark.parametrize("frames", [1, 4, 8])
@pytest.mark.parametrize("legs", [True, False])
def test_the_key_has_every_mark_and_lies_on_the_page(figure, frames, legs):
    motion = standing()
    joints = {"legs": np.zeros((len(motion.t), 2, 6, 3)) + motion.q[:, None, None, :3]}
    found = figure(
        film.filmstrip, motion, tail_points(motion), frames=frames, **(joints if legs else {})
    )
    box, words = found.legends[0].get_window_extent(), found.legends[0].get_texts()
    assert found.bbox.x0 <= box.x0 < box.x1 <= found.bbox.x1
    assert found.bbox.y0 <= box.y0 < box.y1 <= found.bbox.y1
    told = [text.get_text() for text in words]
    assert len(told) == 6 + legs and ("leg" in told) == legs
    assert told[-1].startswith("ground's force, ")


def test_blows_and_weights_are_both_seen(figure):
    found = figure(plots.time_plots, standing())
    (axes,) = [axes for axes in found.axes if axes.get_ylabel().startswith("normal force")]
    for line, count in zip(axes.lines, GROUPS.values(), strict=True):
        drawn = line.get_ydata().min(), line.get_ydata().max()
        assert drawn == pytest.approx((count * WEIGHT, count * BLOW))
    heights = axes.transAxes.inverted().transform(
        axes.transData.transform([(0, force) for force in (0, WEIGHT, 6 * WEIGHT, 6 * BLOW)])
    )[:, 1]
    assert heights[0] == 0 and heights[1] > 0.03 and 0.09 < heights[2] < heights[3] < 1
    assert {each.get_yscale() for each in found.axes if each is not axes} == {"linear"}

"""A live view, served by a real viser: its nodes are where the model says."""

import socket

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.show.live.live import rods
from tests.support import zoo

LEGS = st.Legs.fixed(3.6, -0.3)


def served(name):
    pytest.importorskip("viser")
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port = listener.getsockname()[1]
    return st.live(zoo.model(name), port=port)


@pytest.fixture
def view():
    with served("feet") as opened:
        yield opened


def dropped(**settings):
    settings |= {"legs": LEGS, "t_span": 0.1, "rtol": 1e-6}
    return st.simulate(zoo.model("feet"), [0, 0, 0.06, 1, 0, 0, 0, 0.1, 0], np.zeros(8), **settings)


def assert_at(view, q, legs):
    """The parts are where the model has them in one pose, to float32: rods between their ends."""
    back, feet = view.nodes["back"], zoo.model("feet")
    pose = np.r_[back.batched_positions[0], back.batched_wxyzs[0]]
    np.testing.assert_allclose(pose, q[:7], rtol=0, atol=1e-6)
    for part, points in (("tail", feet.tail_points(q)[None]), ("legs", feet.leg_points(q, legs))):
        node = view.nodes[part]
        turns = Rotation.from_quat(np.roll(node.batched_wxyzs, -1, axis=1))
        half = turns.apply(np.eye(3)[2] * node.batched_scales[:, 2:] / 2)
        for sign, expected in ((-1, points[:, :-1]), (1, points[:, 1:])):
            found = node.batched_positions + sign * half
            np.testing.assert_allclose(found, expected.reshape(-1, 3), rtol=0, atol=1e-6)


def test_a_run_is_shown_where_it_has_come_to(view):
    motion = dropped(watch=view)
    names = {f"/animal/{part}" for part in ("back", "belly", "fur", "eye", "tail", "legs")}
    assert {node.name for node in view.nodes.values()} == names
    assert_at(view, motion.q[-1], motion.contact.legs[-1])
    assert view.text.content == "t = 0.1000 s"
    before = dict(view.nodes)  # it moves and keeps them
    part = motion.resample(motion.t[:50])
    view(part)
    assert view.nodes == before
    assert_at(view, part.q[-1], part.contact.legs[-1])
    q = np.array([0, 0, 1, 0, 1.0, 0, 0, 0, 0])  # upside down: half a turn about x
    still = st.simulate(zoo.model("feet"), q, np.zeros(8), legs=LEGS, t_span=1e-4, method="rk4")
    view(still.resample(still.t[:1]))
    back, head = view.nodes["back"], view.nodes["fur"]
    _, y, z = head.batched_positions[0] - back.batched_positions[0]
    assert z < 0 and y < -0.5 * back.batched_scales[0, 1]
    other = st.simulate(zoo.model("m2_n2"), [0, 0, 0, 1, *[0] * 7], np.zeros(10), t_span=0.01)
    for news in (3, None, "run", other):
        with pytest.raises(st.ViewError, match=r"news: value .*Trajectory or a Plan.* q has 9"):
            view(news)
    with pytest.raises(st.ModelError, match="without 'tail_points'"):
        st.live(zoo.model("bare"))
    assert repr(view) == f"<serpentail live view of feet at {view.url}>"
    assert view.url.startswith("http://127.0.0.1:")


def test_a_plan_is_shown_at_nine_moments_without_legs_or_ground(view, capfd):
    q, v = np.r_[0, 0, 0.3, 1, 0.2, [0] * 4], np.r_[0, 0, 1, 1, [0] * 4]
    rough = {"mesh": st.Mesh(intervals=4), "tolerances": st.Tolerances(attitude=None)}
    rough["solver"] = st.Solver("fatrop", track=False)
    limits = {"duration": 0.2, "bounds": st.Bounds(angle=1.0)}
    plan = st.plan(zoo.model("m1_n3"), start=(q, v), **limits, **rough)
    with served("m1_n3") as alone:
        alone(plan)
        assert "Plan of" in alone.text.content and "legs" not in alone.nodes
        places = alone.nodes["back"].batched_positions
        rows = np.linspace(0, len(plan.trajectory.t) - 1, 9).round().astype(int)
        np.testing.assert_allclose(places, plan.trajectory.q[rows, :3], atol=1e-6)
        assert len(alone.nodes["tail"].batched_positions) == 9 * 3
        alone(plan.trajectory)  # other copies of the same parts
        assert len(alone.nodes["tail"].batched_positions) == 3
        grounds = [each.server.scene.get_handle_by_name("/ground") for each in (alone, view)]
        assert grounds[0] is None and grounds[1] is not None
    assert capfd.readouterr().out == ""


def test_rods_lie_between_their_points():
    points = np.random.default_rng(0).normal(size=(2, 5, 3))
    points[0, 1] = points[0, 0] - [0, 0, 2]  # straight down
    points[1, 2] = points[1, 1]  # no length
    found = rods(points, 0.1)
    along = Rotation.from_quat(np.roll(found.wxyzs, -1, axis=1)).apply([0, 0, 1])
    begins = found.positions - along * found.scales[:, 2:] / 2
    np.testing.assert_allclose(begins, points[:, :-1].reshape(-1, 3), atol=1e-12)
    assert np.isfinite(found.wxyzs).all() and (found.scales[:, :2] == 0.1).all()


def test_a_browser_sees_it_and_the_terminal_does_not_tell_of_it(view, capfd):
    pytest.importorskip("selenium")
    from selenium.webdriver.support.ui import WebDriverWait

    from tests.support import chromium
    from tests.support.page import need

    need(chromium.need_chromium)
    with chromium.chromium() as driver:

        def shown(_):
            return "t = 0.1000 s" in driver.execute_script("return document.body.innerText")

        driver.get(view.url)
        view(dropped())
        assert WebDriverWait(driver, 60).until(shown)
    assert "Connection" not in "".join(capfd.readouterr())

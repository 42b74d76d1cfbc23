"""Moving films, whole or not at all; views, and the torso in a view: its outline, what it hides."""

import dataclasses
import os
import re
import subprocess
import sys
from itertools import pairwise, product

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image, ImageSequence
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.show.pictures import encode
from serpentail.show.pictures.film import even, pictures, speed_words
from serpentail.show.pictures.frames import frames, silhouette
from serpentail.show.pictures.pen import Pen, above_ground
from serpentail.show.pictures.strip import strip_of
from serpentail.show.pictures.views import NAMED, SIDE, TOP, looking, views_of
from tests.support.drawn_flight import SEMI_AXES, flight
from tests.support.rows import row

LASTS = 0.58  # s, the flight
FEW = {"speed": 3.0, "views": ("side",)}  # five frames


def gif_frames(path):
    with Image.open(path) as film:
        assert film.info["loop"] == 0 and film.info["duration"] == 40  # for ever, 25 a second
        return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(film)]


def mp4_frames(path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run([ffmpeg, "-i", path, *raw], capture_output=True, check=True)
    (head,) = set(re.findall(r"Video: h264.*yuv420p.*", done.stderr.decode()))
    assert " 25 fps" in head
    wide, high = map(int, re.search(r", (\d{2,})x(\d{2,})", head).groups())
    return list(np.frombuffer(done.stdout, np.uint8).reshape(-1, high, wide, 3))


def check_frames(path, read, speed):
    settings = {"speed": speed, "views": ("side", "oblique")}
    assert flight().film(str(path), **settings) == path
    frames = read(path)
    assert len(frames) == int(LASTS / speed * 25 + 1e-9) + 1
    for before, after in pairwise(frames):
        changed = np.abs(before.astype(int) - after).max(axis=2) > 60
        assert changed[:-40].sum() > 200  # it moves, not its path and the time below alone
    first = path.read_bytes()
    assert flight().film(path, **settings).read_bytes() == first


def test_a_gif_has_the_frames_of_its_speed_all_different_and_the_same_twice(tmp_path):
    check_frames(tmp_path / "new" / "a.gif", gif_frames, 0.8)
    # several motions move beside each other
    one = gif_frames(flight().film(tmp_path / "a.gif", **FEW))
    two = gif_frames(st.film([flight(), flight((2.6, 2.8))], tmp_path / "b.gif", **FEW))
    assert len(one) == len(two) and two[0].shape[1] > one[0].shape[1]


def test_an_mp4_has_them_too_and_a_gif_its_colours(tmp_path):
    """A gif's palette is made beforehand: no drawn colour may be far from it."""
    pytest.importorskip("imageio_ffmpeg")
    check_frames(tmp_path / "new" / "a.mp4", mp4_frames, 2.0)
    gif = gif_frames(flight().film(tmp_path / "a.gif", **FEW))
    mp4 = mp4_frames(flight().film(tmp_path / "a.mp4", **FEW))
    for one, other in zip(gif, mp4, strict=True):
        assert np.abs(one.astype(int) - other).mean() < 2


def test_a_film_is_slow_motion_of_four_seconds_tells_its_speed_and_ends_in_time(
    tmp_path, monkeypatch
):
    told = []
    moving = sys.modules[st.film.__module__].MOVING
    monkeypatch.setitem(moving, ".gif", lambda _, frames: told.append(frames))
    monkeypatch.setattr("serpentail.show.pictures.film.pictures", lambda strip, slow: (strip, slow))
    flight().film(tmp_path / "a.gif")
    (strip, slowness), *_ = told
    times = [frame.time for frame in strip.films[0]]
    assert slowness == 7 and 3.8 < len(times) / 25 < 4.2
    np.testing.assert_allclose(np.diff(times), 1 / (25 * 7))
    assert times[0] == 0 and LASTS - times[-1] < 1 / (25 * 7)
    for slow, words in ((7, "1/7 of real"), (1, "real"), (0.5, "2 times real"), (2.5, "1/2.5 of")):
        assert speed_words(slow).startswith(words)
    # the last frame is inside, whatever the rounding, if the motion lasts a whole number of frames
    asked, same = [], lambda self, t: asked.append(t) or dataclasses.replace(self)
    monkeypatch.setattr(st.Trajectory, "resample", same)
    for end in np.random.default_rng(2).uniform(0.1, 9, 50):
        motion = dataclasses.replace(flight(), t=np.linspace(0.3, 0.3 + end, 59))
        motion.film(tmp_path / "a.gif", speed=25 * end / 50)
        assert len(asked[-1]) == 51 and asked[-1][-1] <= motion.t[-1]


def test_pictures_have_even_sizes_and_leave_the_look_of_others():
    for pixels in range(100, 1100, 2):  # 4.1 inches of 100 dots are 409.99999999999994
        assert int(Figure(figsize=(even(pixels / 100), 1), dpi=100).bbox.width) == pixels
    strip = strip_of([flight()], 3, [SIDE], None, None)
    before = dict(matplotlib.rcParams)
    for _ in pictures(strip, 1.0):
        assert dict(matplotlib.rcParams) == before


def test_a_film_on_paper_is_the_filmstrip_and_in_html_the_page(tmp_path, monkeypatch):
    for suffix in (".png", ".pdf", ".svg"):
        film, strip = tmp_path / f"film{suffix}", tmp_path / f"strip{suffix}"
        flight().film(film, views=("top",))
        flight().filmstrip(strip, views=("top",))
        assert film.read_bytes() == strip.read_bytes(), suffix
    template = tmp_path / "page"
    monkeypatch.setattr("serpentail.show.page.view.PAGE", template)
    with pytest.raises(st.ViewError, match="not built"):
        flight().film(tmp_path / "film.html")
    template.write_text("<title><!--TITLE--></title>/*DATA*/")
    for draw in (flight().film, flight().view):
        draw(tmp_path / f"{draw.__name__}.html")
    assert (tmp_path / "film.html").read_bytes() == (tmp_path / "view.html").read_bytes()


def test_what_no_film_can_be_is_refused(tmp_path):
    for path, change, words in (
        ("a", {}, "suffix ''"),
        ("a.gif", {"speed": 0}, "speed: value 0"),
        ("a.gif", {"speed": "slow"}, "speed: value 'slow'"),
        ("a.gif", {"speed": 1e-9}, r"speed: 1\.45e\+10 frames .* 10000"),
        ("a.gif", {"views": ("sidee",)}, "'sidee'.*'side'"),
    ):
        with row(path, change), pytest.raises(st.ViewError, match=words):
            flight().film(tmp_path / path, **change)
    with pytest.raises(st.ViewError, match="no time"):
        flight(samples=1).film(tmp_path / "a.gif")
    assert not list(tmp_path.iterdir())


def test_an_encoder_on_path_serves_and_may_fail_or_be_stopped(tmp_path, monkeypatch):
    """It leaves the old file, and does not outlive a stop by the user."""
    path, script = tmp_path / "a.mp4", tmp_path / "ffmpeg"
    path.write_bytes(b"before")
    script.touch(0o700)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    for code, words in (("exit 3", "3"), ("echo the disk is on fire >&2; exit 1", "the disk")):
        script.write_text(f"#!/bin/sh\n{code}\n")
        with row(code), pytest.raises(st.NotWritten, match=rf"a\.mp4.*ffmpeg: {words}"):
            flight().film(path, **FEW)

    def stopped():
        yield np.zeros((64, 64, 3), np.uint8)
        raise KeyboardInterrupt

    script.write_text("#!/bin/sh\nexec cat > /dev/null\n")  # until it is ended
    begun, real = [], subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda *a, **o: begun.append(real(*a, **o)) or begun[0]
    )
    with pytest.raises(KeyboardInterrupt):
        encode.write_mp4(path, stopped())
    assert begun[0].returncode is not None
    assert path.read_bytes() == b"before" and set(tmp_path.iterdir()) == {path, script}


# Views.


def test_points_are_seen_as_after_turning_the_world():
    """The side view of a world that is turned by -azimuth about z, then tipped by the elevation."""
    points = np.random.default_rng(1).normal(size=(20, 3))
    for azimuth, elevation in product((-200, -30, 0, 40, 90), (0, 20, 65, 90)):
        turns = Rotation.from_euler("zy", [-azimuth, elevation], degrees=True)
        found = looking("a", azimuth, elevation).of(points)
        with row(azimuth, elevation):
            np.testing.assert_allclose(found, turns.apply(points)[:, [1, 2, 0]], atol=1e-14)
    np.testing.assert_array_equal(SIDE.matrix, [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    np.testing.assert_array_equal(TOP.matrix, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    # the viewer is where the angles say: 90 degrees is in front of the head
    np.testing.assert_array_equal(looking("a", 90, 0).matrix[2], [0, 1, 0])
    assert NAMED["oblique"].matrix[2].min() > 0  # right of it, before it and above


def test_views_that_are_none_are_refused():
    for views, words in (
        (("sid",), r"views\[0\]: value 'sid': .*'side'"),
        (("side", (1, 2, 3)), r"views\[1\]: value \(1, 2, 3\)"),
        (((0, 120),), r"views\[0\]: value \(0, 120\).* 0 to 90"),
        (((0, 90.1),), r"views\[0\]: value \(0, 90\.1\)"),
        (((0, -0.1),), r"views\[0\]: value \(0, -0\.1\)"),
        (((np.nan, 3),), r"views\[0\]"),
        ("side", "views: value 'side'"),
        ((), r"views: value \(\)"),
    ):
        for refused in (views_of, lambda views: flight().filmstrip(views=views)):
            with row(views), pytest.raises(st.ViewError, match=words):
                refused(views)
    # the ends of the range are in it, by whatever name
    for azimuth, elevation, view in ((0, 0, SIDE), (0, 90, TOP), (360.0, 90.0, TOP)):
        np.testing.assert_array_equal(views_of([(azimuth, elevation)])[0].matrix, view.matrix)


def surface(count=150):
    """Points on the torso's ellipsoid, in its frame."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, count), np.linspace(0, 2 * np.pi, 2 * count))
    sphere = [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
    return np.stack(sphere, axis=-1).reshape(-1, 3) * SEMI_AXES


def film_frame(seed, height=0.06):
    """One frame in a random attitude."""
    trajectory = flight(samples=1)
    q = trajectory.q.copy()
    q[:, 2], q[:, 3:7] = height, Rotation.random(rng=seed).as_quat()
    return frames(trajectory.model, dataclasses.replace(trajectory, q=q), [0], 0.0)[0]


def widths(points):
    """How far points (P, 2) reach in 90 directions."""
    angle = np.linspace(0, 2 * np.pi, 90)
    return (points @ np.stack([np.cos(angle), np.sin(angle)])).max(axis=0)


def test_silhouette_is_the_outline_of_the_projected_surface():
    for seed, view in product(range(5), NAMED.values()):
        rotation = Rotation.random(rng=seed).as_matrix()
        shadow = view.of(surface() @ rotation.T)[:, :2]
        outline = silhouette(rotation, SEMI_AXES, view, count=721)
        with row(seed, view.name):
            np.testing.assert_allclose(widths(outline), widths(shadow), rtol=2e-4)
            np.testing.assert_allclose(outline[0], outline[-1], atol=1e-15)


def test_the_torso_hides_exactly_what_a_ray_to_the_viewer_hits():
    for seed, view in product(range(3), NAMED.values()):
        frame = film_frame(seed)
        points = frame.torso + np.random.default_rng(seed).uniform(-0.06, 0.06, (400, 3))
        steps = np.linspace(0, 0.2, 2001)[:, None, None] * view.matrix[2]
        ray = np.linalg.norm((points + steps - frame.torso) @ frame.rotation / SEMI_AXES, axis=-1)
        nearest, over = ray.min(axis=0), frame.in_front(points, view)
        # beside the torso nothing is covered
        spread = view.matrix[:2] @ frame.rotation * SEMI_AXES
        flat = view.of(points - frame.torso)[:, :2]
        covered = np.einsum("ni,ij,nj->n", flat, np.linalg.inv(spread @ spread.T), flat) < 1
        with row(seed, view.name):
            assert not (over & (nearest < 1 - 1e-3)).any()
            assert not (~over & covered & (nearest > 1 + 1e-3)).any()


def test_what_is_above_the_ground_is_outlined():
    for seed, view, height in product(range(2), NAMED.values(), (-0.02, 0.005)):
        frame = film_frame(seed, height)
        world = frame.torso + surface(300) @ frame.rotation.T
        shadow = view.of(world[world[:, 2] >= 0])[:, :2]
        outline = view.of(above_ground(frame))[:, :2]
        outline = outline[ConvexHull(outline).vertices]
        with row(seed, view.name, height):
            np.testing.assert_allclose(widths(outline), widths(shadow), atol=5e-4)
    # above the ground there is no part below
    frame = film_frame(1, height=0.06)
    assert above_ground(frame) is None and frame.lowest < 0.06 - SEMI_AXES.min()
    assert len(above_ground(film_frame(1, height=-0.06))) == 0


def test_a_line_before_the_torso_has_a_rim_and_one_behind_is_hidden():
    """Seen from the right, +x: of a line across, what is drawn over the torso, and its rim."""
    frame = dataclasses.replace(film_frame(0), rotation=np.eye(3))
    for side, colours in ((1, ["white", "red"]), (-1, [])):
        axes = Figure().subplots()
        pen = Pen(axes, frame, NAMED["side"], frame.torso)
        across = frame.torso + np.array([[0.05 * side, -0.2, 0], [0.05 * side, 0.2, 0]])
        pen.line(across, color="red", linewidth=1.0)
        over = [line for line in axes.lines if line.get_zorder() > 0.4]  # the torso's level
        assert [line.get_color() for line in over] == colours
        assert all(np.ptp(line.get_xdata()) == pytest.approx(0.4) for line in axes.lines)

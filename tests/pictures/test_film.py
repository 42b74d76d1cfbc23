"""Moving films: as many frames as their speed asks for, all different, whole or not at all."""

import dataclasses
import re
import subprocess
import sys
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image, ImageSequence

import serpentail as st
from serpentail.pictures import encode
from serpentail.pictures.filmstrip import strip_of
from serpentail.pictures.movie import even, pictures, speed_words
from serpentail.pictures.views import SIDE
from tests.support.drawn_flight import flight
from tests.support.rows import row

LASTS = 0.58  # s, the flight
MODULE = sys.modules[st.film.__module__]
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
    monkeypatch.setitem(MODULE.MOVING, ".gif", lambda _, frames: told.append(frames))
    monkeypatch.setattr("serpentail.pictures.film.pictures", lambda strip, slow: (strip, slow))
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
    monkeypatch.setattr("serpentail.viewer.view.PAGE", template)
    with pytest.raises(st.ViewError, match="not built"):
        flight().film(tmp_path / "film.html")
    template.write_text("<title><!--TITLE--></title>/*DATA*/")
    for draw in (flight().film, flight().view):
        draw(tmp_path / f"{draw.__name__}.html")
    assert (tmp_path / "film.html").read_bytes() == (tmp_path / "view.html").read_bytes()


def test_what_no_film_can_be_is_refused(tmp_path):
    for path, change, words in (
        ("a.avi", {}, r"'\.avi'.* \.gif, \.html, \.mp4, \.pdf, \.png, \.svg"),
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


# Encoders.


def test_without_an_encoder_the_remedy_is_told_first_and_one_on_path_serves(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("shutil.which", lambda name: None)
    with pytest.raises(st.ViewError, match=r'pip install "serpentail\[film\]"'):
        flight().film(tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr("shutil.which", lambda name: "found" if name == "ffmpeg" else None)
    assert encode.encoder() == "found"


def test_an_encoder_that_fails_leaves_the_old_file_and_a_stop_by_the_user_ends_it(
    tmp_path, monkeypatch
):
    path, script = tmp_path / "a.mp4", tmp_path / "ffmpeg"
    path.write_bytes(b"before")
    script.touch(0o700)
    monkeypatch.setattr(encode, "encoder", lambda: str(script))
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

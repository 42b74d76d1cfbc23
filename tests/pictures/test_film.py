"""Moving films: as many frames as their speed asks for, all of them different, whole or not at
all.
"""

import dataclasses
import re
import subprocess
import sys
from itertools import pairwise

import imageio_ffmpeg
import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import serpentail as st
from serpentail.pictures import encode
from serpentail.pictures.filmstrip import strip_of
from serpentail.pictures.movie import even, pictures, speed_words
from serpentail.pictures.views import SIDE
from tests.support.drawn_flight import flight

LASTS = 0.58  # s, the flight


def gif_frames(path):
    with Image.open(path) as film:
        assert film.info["loop"] == 0 and film.info["duration"] == 40  # for ever, 25 a second
        frames = []
        for k in range(film.n_frames):
            film.seek(k)
            frames.append(np.asarray(film.convert("RGB")))
    return frames


def mp4_frames(path):
    ffmpeg = imageio_ffmpeg.get_ffmpeg_exe()
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run([ffmpeg, "-i", path, *raw], capture_output=True, check=True)
    (head,) = set(re.findall(r"Video: h264.*yuv420p.*", done.stderr.decode()))
    assert " 25 fps" in head
    wide, high = map(int, re.search(r", (\d{2,})x(\d{2,})", head).groups())
    return list(np.frombuffer(done.stdout, np.uint8).reshape(-1, high, wide, 3))


READ = {".gif": gif_frames, ".mp4": mp4_frames}


@pytest.mark.parametrize("suffix", READ)
@pytest.mark.parametrize("speed", [1.0, 0.5])
def test_a_film_has_the_frames_of_its_speed(tmp_path, suffix, speed):
    path = tmp_path / "new" / f"a{suffix}"
    assert flight().film(str(path), speed=speed) == path
    frames = READ[suffix](path)
    assert len(frames) == int(LASTS / speed * 25 + 1e-9) + 1
    for before, after in pairwise(frames):
        changed = np.abs(before.astype(int) - after).max(axis=2) > 60
        assert changed[:-40].sum() > 200  # it moves, not its path and the time below alone
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_film_is_slow_motion_of_four_seconds(tmp_path, monkeypatch):
    told = []
    monkeypatch.setitem(
        sys.modules[st.film.__module__].MOVING, ".gif", lambda _, frames: told.append(frames)
    )
    monkeypatch.setattr("serpentail.pictures.film.pictures", lambda strip, slow: (strip, slow))
    flight().film(tmp_path / "a.gif")
    (strip, slowness), *_ = told
    times = [frame.time for frame in strip.films[0]]
    assert slowness == 7 and 3.8 < len(times) / 25 < 4.2
    np.testing.assert_allclose(np.diff(times), 1 / (25 * 7))
    assert times[0] == 0 and LASTS - times[-1] < 1 / (25 * 7)


@pytest.mark.parametrize(
    ("slowness", "words"),
    [(7, "1/7 of real time"), (1, "real time"), (0.5, "2 times real time"), (2.5, "1/2.5 of")],
)
def test_a_film_tells_its_speed(slowness, words):
    assert speed_words(slowness).startswith(words)


def test_pictures_have_even_sizes():
    """4.1 inches at 100 dots an inch are 409.99999999999994."""
    for pixels in range(100, 1100, 2):
        assert int(Figure(figsize=(even(pixels / 100), 1), dpi=100).bbox.width) == pixels


def test_the_look_of_others_is_theirs_between_two_pictures():
    strip = strip_of([flight()], 3, [SIDE], None, None)
    before = dict(matplotlib.rcParams)
    for _ in pictures(strip, 1.0):
        assert dict(matplotlib.rcParams) == before


def test_the_same_film_twice(tmp_path):
    for suffix in READ:
        paths = [flight().film(tmp_path / f"{k}{suffix}", speed=2.0) for k in range(2)]
        assert paths[0].read_bytes() == paths[1].read_bytes()


def test_several_motions_move_beside_each_other(tmp_path):
    alone = flight().film(tmp_path / "a.gif", speed=3.0, views=("side",))
    both = st.film(
        [flight(), flight((2.6, 2.8))], tmp_path / "b.gif", speed=3.0, views=("side", "oblique")
    )
    one, two = (gif_frames(path) for path in (alone, both))
    assert len(one) == len(two) and two[0].shape[1] > one[0].shape[1]


def test_colours_of_a_gif_are_those_of_the_film(tmp_path):
    """Its palette is made beforehand: no drawn colour may be far from it."""
    gif = gif_frames(flight().film(tmp_path / "a.gif", speed=1.0))
    mp4 = mp4_frames(flight().film(tmp_path / "a.mp4", speed=1.0))
    for one, other in zip(gif, mp4, strict=True):
        assert np.abs(one.astype(int) - other).mean() < 2


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_a_film_on_paper_is_the_filmstrip(tmp_path, suffix):
    flight().film(tmp_path / f"film{suffix}")
    flight().filmstrip(tmp_path / f"strip{suffix}")
    assert (tmp_path / f"film{suffix}").read_bytes() == (tmp_path / f"strip{suffix}").read_bytes()


def test_an_html_film_is_the_page(tmp_path, monkeypatch):
    template = tmp_path / "page"
    monkeypatch.setattr("serpentail.viewer.view.PAGE", template)
    with pytest.raises(st.ViewError, match="the page was not built"):
        flight().film(tmp_path / "film.html")
    template.write_text("<title><!--TITLE--></title>/*DATA*/")
    for draw in (flight().film, flight().view):
        draw(tmp_path / f"{draw.__name__}.html")
    assert (tmp_path / "film.html").read_bytes() == (tmp_path / "view.html").read_bytes()


@pytest.mark.parametrize(
    ("path", "change", "words"),
    [
        ("a.avi", {}, r"has suffix '.avi': use one of .gif, .html, .mp4, .pdf, .png, .svg"),
        ("a", {}, "has suffix '': use one of"),
        ("a.gif", {"speed": 0}, "speed: value 0: needs a number above 0"),
        ("a.gif", {"speed": "slow"}, "speed: value 'slow': needs a number above 0"),
        (
            "a.gif",
            {"speed": 1e-9},
            r"speed: 1.45e\+10 frames .*at most 10000; give a greater speed",
        ),
        ("a.gif", {"views": ("sidee",)}, "did you mean 'side'"),
    ],
)
def test_what_no_film_can_be_is_refused(tmp_path, path, change, words):
    with pytest.raises(st.ViewError, match=words):
        flight().film(tmp_path / path, **change)
    assert not list(tmp_path.iterdir())


def test_the_last_frame_lies_in_the_motion(tmp_path, monkeypatch):
    """Whatever the rounding, where the motion lasts a whole number of frames."""
    seen = []
    monkeypatch.setattr(
        st.Trajectory, "resample", lambda self, t: (seen.append(t), dataclasses.replace(self))[1]
    )
    monkeypatch.setattr("serpentail.pictures.film.pictures", lambda *_: iter(()))
    monkeypatch.setitem(sys.modules[st.film.__module__].MOVING, ".gif", lambda *_: None)
    for end in np.random.default_rng(2).uniform(0.1, 9, 50):
        motion = dataclasses.replace(flight(), t=np.linspace(0.3, 0.3 + end, 59))
        motion.film(tmp_path / "a.gif", speed=25 * end / 50)
        assert len(seen[-1]) == 51 and seen[-1][-1] <= motion.t[-1]


def test_a_motion_without_time_makes_no_film(tmp_path):
    with pytest.raises(st.ViewError, match="they have no time in common"):
        flight(samples=1).film(tmp_path / "a.gif")


# Encoders.


@pytest.fixture
def bare(monkeypatch):
    """A machine without imageio-ffmpeg and without ffmpeg."""
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("shutil.which", lambda name: None)


def test_without_an_encoder_the_remedy_is_told_first(tmp_path, bare):
    with pytest.raises(st.ViewError, match=r'pip install "serpentail\[film\]"'):
        flight().film(tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_ffmpeg_on_path_serves_as_well(tmp_path, bare, monkeypatch):
    found = imageio_ffmpeg.get_ffmpeg_exe()
    monkeypatch.setattr("shutil.which", lambda name: found if name == "ffmpeg" else None)
    assert encode.encoder() == found
    assert len(mp4_frames(flight().film(tmp_path / "a.mp4", speed=2.0))) == 8


@pytest.mark.parametrize("code", ["exit 3", "echo the disk is on fire >&2; exit 1"])
def test_an_encoder_that_fails_leaves_the_old_file(tmp_path, monkeypatch, code):
    script = tmp_path / "ffmpeg"
    script.write_text(f"#!/bin/sh\n{code}\n")
    script.chmod(0o700)
    monkeypatch.setattr(encode, "encoder", lambda: str(script))
    (tmp_path / "a.mp4").write_bytes(b"before")
    with pytest.raises(st.NotWritten, match=r"a.mp4.*is not written \(ffmpeg: (the disk|3)"):
        flight().film(tmp_path / "a.mp4", speed=3.0)
    assert (tmp_path / "a.mp4").read_bytes() == b"before"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mp4", "ffmpeg"]


def test_a_stop_by_the_user_ends_the_encoder(tmp_path, monkeypatch):
    begun = []
    real = subprocess.Popen

    def kept(*arguments, **options):
        begun.append(real(*arguments, **options))
        return begun[-1]

    def stopped():
        yield np.zeros((64, 64, 3), np.uint8)
        raise KeyboardInterrupt

    monkeypatch.setattr(subprocess, "Popen", kept)
    with pytest.raises(KeyboardInterrupt):
        encode.write_mp4(tmp_path / "a.mp4", stopped())
    assert begun[0].returncode is not None and not list(tmp_path.iterdir())

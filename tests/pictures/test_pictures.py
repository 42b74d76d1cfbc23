"""Laws of all figures: written whole or not at all, equal bytes twice, no global state."""

import os
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest

import serpentail as st
from tests.support.drawn_flight import SPEEDS, flight

STARTS = {".pdf": b"%PDF-", ".png": b"\x89PNG", ".svg": b"<?xml"}
DRAWN = {
    "film": lambda motion, path: motion.filmstrip(path),
    "times": lambda motion, path: motion.plot(path=path),
}


@pytest.mark.parametrize("suffix", STARTS)
@pytest.mark.parametrize(
    "speed", ["up", *(pytest.param(name, marks=pytest.mark.slow) for name in ("far", "still"))]
)
def test_figures_are_written_in_every_format(tmp_path, suffix, speed):
    for name, draw in DRAWN.items():
        path = tmp_path / "new" / f"{name}{suffix}"
        figure, axes = draw(flight(SPEEDS[speed]), path)
        assert path.read_bytes().startswith(STARTS[suffix])
        assert set(axes.ravel()) <= set(figure.axes)
    written = sorted(p.name for p in tmp_path.rglob("*.*"))
    assert written == [f"film{suffix}", f"times{suffix}"]


@pytest.mark.parametrize(
    "suffix", [".svg", *(pytest.param(s, marks=pytest.mark.slow) for s in (".pdf", ".png"))]
)
@pytest.mark.parametrize("name", DRAWN)
def test_the_same_bytes_twice_whatever_the_user_has_set(tmp_path, suffix, name):
    first, second = (tmp_path / f"{k}{suffix}" for k in (1, 2))
    DRAWN[name](flight(), first)
    with matplotlib.rc_context({"font.size": 20, "axes.facecolor": "red", "svg.fonttype": "none"}):
        DRAWN[name](flight(), second)
        assert matplotlib.rcParams["font.size"] == 20
    assert first.read_bytes() == second.read_bytes()


def test_drawing_leaves_pyplot_alone_and_importing_leaves_matplotlib_alone(tmp_path):
    code = (
        "import sys, serpentail.pictures.film, serpentail.pictures.filmstrip, "
        "serpentail.pictures.plot, serpentail.motion.trajectory\n"
        "assert not {'matplotlib', 'scipy', 'PIL'} & set(sys.modules)\n"
        "from tests.support.drawn_flight import flight\n"
        "flight().filmstrip('film.svg'), flight().plot(path='times.svg')\n"
        "flight().film('film.gif', speed=3.0)\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    packages = [str(Path(st.__file__).parents[1]), str(Path(__file__).parents[2])]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(packages),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)


@pytest.mark.parametrize("name", DRAWN)
def test_a_failed_drawing_leaves_the_old_file(tmp_path, monkeypatch, name):
    path = tmp_path / "a.svg"
    DRAWN[name](flight(), path)
    before = path.read_bytes()

    def cut_short(figure, stream, **options):
        stream.write(b"half")
        raise OSError("no space left")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", cut_short)
    with pytest.raises(OSError, match="no space left"):
        DRAWN[name](flight(samples=20), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["film.gif", "film", "film.svgz"])
@pytest.mark.parametrize("draw", DRAWN)
def test_unknown_suffix_lists_the_known(tmp_path, name, draw):
    with pytest.raises(ValueError, match=r"use one of \.pdf, \.png, \.svg"):
        DRAWN[draw](flight(), tmp_path / "new" / name)
    assert not (tmp_path / "new").exists()


def test_a_notebook_shows_a_figure():
    for figure, _ in (flight().filmstrip(frames=2), flight().plot("height")):
        assert figure._repr_png_().startswith(STARTS[".png"])


@pytest.mark.parametrize("name", DRAWN)
def test_a_figure_keeps_its_look_until_it_is_saved(tmp_path, name):
    """Whoever saves it, with whatever settings: Matplotlib makes ticks when it draws."""
    figures = [DRAWN[name](flight(), None)[0] for _ in range(2)]
    figures[0].savefig(tmp_path / "a.png")
    with matplotlib.rc_context({"font.size": 20, "xtick.color": "red", "axes.linewidth": 5}):
        figures[1].savefig(tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()

"""Laws of all figures: written whole or not at all, equal bytes twice, no global state."""

import os
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest

import serpentail as st
from tests.support.drawn_flight import flight
from tests.support.rows import row

STARTS = {".pdf": b"%PDF-", ".png": b"\x89PNG", ".svg": b"<?xml"}
DRAWN = {
    "film": lambda motion, path: motion.filmstrip(path, frames=1, views=("side",)),
    "times": lambda motion, path: motion.plot("height", path=path),
}
OTHERS = {"font.size": 20, "axes.facecolor": "red", "svg.fonttype": "none", "xtick.color": "red"}


def test_figures_are_the_same_twice_in_every_format_whatever_the_user_has_set(tmp_path):
    for name, draw in DRAWN.items():
        for suffix, start in STARTS.items():
            first, second = (tmp_path / f"new {k}" / f"{name}{suffix}" for k in (1, 2))
            figure, axes = draw(flight(), first)
            assert first.read_bytes().startswith(start) and set(axes.ravel()) <= set(figure.axes)
            with matplotlib.rc_context(OTHERS):
                draw(flight(), second)
                assert matplotlib.rcParams["font.size"] == 20
            assert first.read_bytes() == second.read_bytes(), first.name
    written = {path.name for path in tmp_path.glob("new*/*")}
    assert written == {f"{name}{suffix}" for name in DRAWN for suffix in STARTS}


def test_a_figure_keeps_its_look_until_it_is_saved(tmp_path):
    """Whoever saves it, with whatever settings: Matplotlib makes ticks when it draws."""
    for draw in (flight().filmstrip, flight().plot):
        figures = [draw()[0] for _ in range(2)]
        figures[0].savefig(tmp_path / "a.png")
        with matplotlib.rc_context(OTHERS):
            figures[1].savefig(tmp_path / "b.png")
        assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
        assert figures[0]._repr_png_().startswith(STARTS[".png"])


def test_drawing_leaves_pyplot_alone_and_importing_leaves_matplotlib_alone(tmp_path):
    code = (
        "import sys, serpentail.pictures.film, serpentail.pictures.filmstrip, "
        "serpentail.pictures.plot, serpentail.motion.trajectory\n"
        "assert not {'matplotlib', 'scipy', 'PIL'} & set(sys.modules)\n"
        "from tests.support.drawn_flight import flight\n"
        "flight().filmstrip('film.svg', frames=1), flight().plot('tilt', path='times.svg')\n"
        "flight().film('film.gif', speed=9.0)\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    packages = [str(Path(st.__file__).parents[1]), str(Path(__file__).parents[2])]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(packages),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)


def test_a_failed_drawing_leaves_the_old_file(tmp_path, monkeypatch):
    def cut_short(figure, stream, **options):
        stream.write(b"half")
        raise OSError("no space left")

    path = tmp_path / "a.svg"
    path.write_bytes(b"before")
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", cut_short)
    for draw in DRAWN.values():
        with pytest.raises(OSError, match="no space left"):
            draw(flight(samples=20), path)
        assert path.read_bytes() == b"before" and list(tmp_path.iterdir()) == [path]
        for name in ("film.gif", "film", "film.svgz"):
            with row(name), pytest.raises(ValueError, match=r"\.pdf, \.png, \.svg"):
                draw(flight(), tmp_path / "new" / name)
            assert not (tmp_path / "new").exists()

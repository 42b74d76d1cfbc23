"""A file that cannot be written is one clear error: the old file stays whole, and nothing else is
left, whenever and however the system refuses.
"""

import builtins
import errno
import io
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import serpentail as st
from serpentail.files import refuse_unwritable
from tests.support.drawn_flight import flight

ROOT = Path(__file__).parents[2]
WRITERS = {
    "run.npz": lambda motion, path: motion.save(path),
    "times.svg": lambda motion, path: motion.plot(path=path),
    "times.png": lambda motion, path: motion.plot(path=path),
    "film.pdf": lambda motion, path: motion.film(path),
    "film.gif": lambda motion, path: motion.film(path, speed=2.0),
}
ERRORS = ("ENOSPC", "EIO", "EFBIG", "EDQUOT", "EACCES", "EXDEV")
OLD = b"what was there before"
every_writer = pytest.mark.parametrize("name", WRITERS)
refusals = [
    pytest.param(name, code, marks=[] if "ENOSPC" in code or "npz" in name else pytest.mark.slow)
    for name in WRITERS
    for code in ERRORS
]


@cache
def size(name):
    """How many bytes a writer writes."""
    with TemporaryDirectory() as folder:
        WRITERS[name](flight(samples=20), Path(folder) / name)
        return (Path(folder) / name).stat().st_size


class Refusing(io.FileIO):
    """A file whose device takes so many bytes and then refuses."""

    room, code = 0, errno.ENOSPC

    def write(self, data):
        if self.tell() + len(data) > self.room:
            raise OSError(self.code, os.strerror(self.code))
        return super().write(data)


@pytest.fixture
def full(monkeypatch):
    """Return a function that lets files that are being written take so many bytes only."""
    real = builtins.open

    def lent(file, mode="r", *rest, **options):
        if not (isinstance(file, str | os.PathLike) and str(file).endswith(".part")):
            return real(file, mode, *rest, **options)
        raw = Refusing(file, mode.replace("b", ""))
        return io.BufferedRandom(raw, 512) if "+" in mode else io.BufferedWriter(raw, 512)

    def restrict(room, code):
        monkeypatch.setattr(Refusing, "room", room)
        monkeypatch.setattr(Refusing, "code", code)
        for module in (builtins, io):
            monkeypatch.setattr(module, "open", lent)

    return restrict


def refused(name, folder, words):
    """Write another motion over a file: it must be refused, and the file be as it was."""
    path = folder / name
    path.write_bytes(OLD)
    with pytest.raises(st.NotWritten) as caught:
        WRITERS[name](flight(samples=20), path)
    assert str(path) in str(caught.value) and words in str(caught.value)
    assert "\n" not in str(caught.value) and isinstance(caught.value, OSError)
    assert path.read_bytes() == OLD
    assert [p.name for p in folder.iterdir()] == [name]


@pytest.mark.parametrize(("name", "code"), refusals)
@pytest.mark.parametrize("part", [0.0, 0.5, 1.0])
def test_a_device_that_refuses_leaves_the_old_file(name, code, part, full, tmp_path):
    """At the first byte, at half of the file, at the last byte."""
    number = getattr(errno, code)
    full(max(0, round(part * size(name)) - 1), number)
    refused(name, tmp_path, os.strerror(number))


@pytest.mark.parametrize(("name", "code"), refusals)
def test_a_name_that_cannot_be_given_leaves_the_old_file(name, code, monkeypatch, tmp_path):
    number = getattr(errno, code)

    def refuse(*_names, **_options):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "replace", refuse)
    refused(name, tmp_path, os.strerror(number))


@every_writer
def test_a_limit_of_the_system_leaves_the_old_file(name, tmp_path):
    """The same without a stand-in: the system itself refuses files of more than 2000 bytes."""
    path = tmp_path / name
    path.write_bytes(OLD)
    code = (
        "import resource, sys; from pathlib import Path; import serpentail as st\n"
        "from tests.house.test_files import WRITERS\n"
        "from tests.support.drawn_flight import flight\n"
        "motion = flight(samples=40)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))\n"
        "try:\n    WRITERS[sys.argv[1]](motion, Path(sys.argv[1]))\n"
        "except st.NotWritten as error:\n    print(error)\n"
    )
    packages = [str(Path(st.__file__).parents[1]), str(ROOT)]
    done = subprocess.run(
        [sys.executable, "-c", code, name],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(packages), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert f"{name!r} is not written (File too large)" in done.stdout
    assert path.read_bytes() == OLD and list(tmp_path.iterdir()) == [path]


@every_writer
def test_a_folder_that_cannot_be_is_told(name, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(st.NotWritten, match=r"file.*is not written"):
        WRITERS[name](flight(samples=20), tmp_path / "file" / name)
    (tmp_path / name).mkdir()
    with pytest.raises(st.NotWritten, match="Is a directory"):
        WRITERS[name](flight(samples=20), tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["file", name])
    assert (tmp_path / "file").read_text() == "mine" and not any((tmp_path / name).iterdir())


@every_writer
@pytest.mark.parametrize("place", ["a\0b{}", "a\0b/c{}"])
def test_a_name_with_nul_is_told(name, place, tmp_path):
    path = tmp_path / place.format(Path(name).suffix)
    with pytest.raises(st.NotWritten, match=r"^'[^\n]*\(a path cannot contain the .*NUL\)"):
        WRITERS[name](flight(samples=20), path)
    with pytest.raises(st.NotWritten, match="NUL"):
        refuse_unwritable(path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", ["", ".", "/"])
def test_a_path_without_a_name_is_told(path):
    with pytest.raises(st.NotWritten, match="it is a folder"):
        flight(samples=20).save(path)
    with pytest.raises(FileNotFoundError, match="no trajectory file"):
        st.Trajectory.load(path)


@every_writer
def test_a_stop_by_the_user_leaves_the_old_file(name, tmp_path, monkeypatch):
    """What is no error of the system is passed on as it is."""
    (tmp_path / name).write_bytes(OLD)

    def stopped(*_names, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", stopped)
    with pytest.raises(KeyboardInterrupt):
        WRITERS[name](flight(samples=20), tmp_path / name)
    assert (tmp_path / name).read_bytes() == OLD
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_what_was_written_is_read_again_after_a_refusal(full, tmp_path, monkeypatch):
    motion = flight(samples=20)
    motion.save(tmp_path / "run")
    with monkeypatch.context() as patch:
        full(100, errno.ENOSPC)
        with pytest.raises(st.NotWritten):
            flight(samples=30).save(tmp_path / "run")
        patch.undo()
    np.testing.assert_array_equal(st.Trajectory.load(tmp_path / "run").q, motion.q)

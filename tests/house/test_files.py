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

import pytest

import serpentail as st
from serpentail.files import refuse_unusable, refuse_unwritable
from tests.support.drawn_flight import flight
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
WRITERS = {
    "run.npz": lambda motion, path: motion.save(path),
    "times.svg": lambda motion, path: motion.plot(path=path),
    "times.png": lambda motion, path: motion.plot(path=path),
    "film.pdf": lambda motion, path: motion.film(path),
    "film.gif": lambda motion, path: motion.film(path, speed=2.0),
}
CODES = ("ENOSPC", "EIO", "EFBIG", "EDQUOT", "EACCES", "EXDEV")
OLD = b"what was there before"
LIMITED = """
import resource, sys
from pathlib import Path
import serpentail as st
from tests.house.test_files import WRITERS
from tests.support.drawn_flight import flight

motion = flight(samples=40)
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
for name in sys.argv[1:]:
    try:
        WRITERS[name](motion, Path(name))
    except st.NotWritten as error:
        print(error)
"""
QUICK = ("run.npz", "film.gif")  # drawings take long
each_writer = pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in WRITERS]
)


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
    unchanged(folder, name)


def unchanged(folder, *names):
    """Nothing but the old files is there."""
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)
    assert all((folder / name).read_bytes() == OLD for name in names)


@each_writer
def test_a_device_that_refuses_leaves_the_old_file(name, full, tmp_path):
    """At half of the file; of one kind at the first byte and at the last byte, too."""
    for part, code in [(0.5, "EIO"), (0.0, "ENOSPC"), (1.0, "ENOSPC")][
        : 3 if name == "run.npz" else 1
    ]:
        with row(name, part, code):
            number = getattr(errno, code)
            full(max(0, round(part * size(name)) - 1), number)
            refused(name, tmp_path, os.strerror(number))


@each_writer
def test_a_name_that_cannot_be_given_leaves_the_old_file(name, monkeypatch, tmp_path):
    for code in CODES if name == "run.npz" else CODES[:1]:
        error = OSError(getattr(errno, code), os.strerror(getattr(errno, code)))

        def refuse(*_names, error=error, **_options):
            raise error

        with row(code), monkeypatch.context() as patch:
            patch.setattr(os, "replace", refuse)
            refused(name, tmp_path, error.strerror)


def test_a_stop_by_the_user_leaves_the_old_file(tmp_path, monkeypatch):
    """What is no error of the system is passed on as it is."""

    def stopped(*_names, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", stopped)
    for name in QUICK:
        (tmp_path / name).write_bytes(OLD)
        with row(name), pytest.raises(KeyboardInterrupt):
            WRITERS[name](flight(samples=20), tmp_path / name)
    unchanged(tmp_path, *QUICK)


@pytest.mark.parametrize("names", [QUICK[:1], pytest.param(WRITERS, marks=pytest.mark.slow)])
def test_a_limit_of_the_system_leaves_the_old_file(names, tmp_path):
    """The same without a stand-in: the system itself refuses files of more than 2000 bytes."""
    for name in names:
        (tmp_path / name).write_bytes(OLD)
    packages = os.pathsep.join([str(Path(st.__file__).parents[1]), str(ROOT)])
    own = os.environ | {"PYTHONPATH": packages, "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", LIMITED, *names]
    told = subprocess.check_output(command, cwd=tmp_path, env=own, text=True)
    for name, line in zip(names, told.splitlines(), strict=True):
        assert f"{name!r}" in line and "(File too large)" in line
    unchanged(tmp_path, *names)


@pytest.mark.parametrize("name", QUICK)
def test_a_path_that_cannot_be_is_told(name, tmp_path):
    (tmp_path / "file").write_bytes(OLD)
    (tmp_path / "folders" / name).mkdir(parents=True)
    places = [
        (tmp_path / "folders" / name, "Is a directory"),
        (tmp_path / "file" / name, r"file.*is not written"),
        (tmp_path / f"a\0b{Path(name).suffix}", r"^'[^\n]*NUL"),
        (tmp_path / f"a\0b/c{Path(name).suffix}", r"^'[^\n]*NUL"),
    ]
    for place, words in places[: 4 if name == "run.npz" else 1]:
        with row(place), pytest.raises(st.NotWritten, match=words):
            WRITERS[name](flight(samples=20), place)
    assert not any((tmp_path / "folders" / name).iterdir())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folders"]
    assert (tmp_path / "file").read_bytes() == OLD


def test_a_path_is_checked_before_the_work(tmp_path):
    for path in ("", ".", "/"):
        with row(path), pytest.raises(st.NotWritten, match="folder"):
            flight(samples=20).save(path)
        with row(path), pytest.raises(FileNotFoundError, match="no trajectory file"):
            st.Trajectory.load(path)
    (tmp_path / "file").write_bytes(OLD)
    for path, error in [
        (tmp_path / "a\0b", st.NotWritten),
        (tmp_path, IsADirectoryError),
        (tmp_path / "file" / "below" / "run.npz", NotADirectoryError),
    ]:
        with row(path), pytest.raises(error, match=tmp_path.name):
            refuse_unwritable(path)
    refuse_unwritable(tmp_path / "file")
    refuse_unwritable(tmp_path / "new" / "folder" / "run.npz")
    refuse_unusable(tmp_path / "new")
    unchanged(tmp_path, "file")

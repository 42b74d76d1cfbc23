"""What users give is checked in one idiom; a file that cannot be written is one clear error, and
the old file stays whole, whenever and however the system refuses.
"""

import dataclasses
import errno
import fcntl
import os
import pty
import resource
import stat
import threading
import time
import tty
from contextlib import closing
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

import serpentail as st
from serpentail.basics.checks import (
    did_you_mean,
    finite_array,
    number,
    numbers,
    one_of,
    real_array,
    shown,
    whole_number,
)
from serpentail.basics.errors import PlanningError
from serpentail.basics.files import refuse_unusable, refuse_unwritable, replacing
from tests.support.drawn_flight import flight
from tests.support.file_faults import age, before_calls, killed_at
from tests.support.rows import row

BAD = [  # what is checked, how, and the value and the need that the error names
    (number, ["600"], {"above": 0}, "'600'.*above 0.*remove the quotes"),
    (number, ["short"], {}, "'short'.*not a text$"),
    (number, [True], {}, "True.*finite"),
    (number, [[1.0]], {}, r"\[1.0\].*finite"),
    (number, [np.nan], {}, "nan.*finite"),
    (number, [0], {"above": 0}, "0.*above 0$"),
    (number, [0.0], {"above": 0}, "0.*above 0$"),
    (number, [np.inf], {"above": 0}, "inf.*above 0$"),
    (number, [-1], {"least": 0}, "-1.*from 0$"),
    (number, [1.5], {"least": 0, "most": 1}, "1.5.*from 0 to 1$"),
    (numbers, ["1", 3], {}, "'1'.*one or 3.*remove the quotes"),
    (numbers, [[1, 2], 3], {}, r"\[1, 2\].*one or 3 finite"),
    (numbers, [-1, 3], {"least": 0}, "-1.*one or 3.*from 0$"),
    (numbers, [[1, 2, 9], 3], {"most": 5}, r"9\].*finite numbers to 5$"),
    (whole_number, ["2"], {"least": 1, "most": 9}, "'2'.*from 1 to 9.*remove the quotes"),
    (whole_number, [0], {"least": 1, "most": 9}, "0.*from 1 to 9$"),
    (whole_number, [10], {"least": 1, "most": 9}, "10.*from 1 to 9$"),
    (whole_number, [True], {"least": 0, "most": 9}, "True"),
    (whole_number, [2.0], {"least": 1, "most": 9}, "2.0"),
    (real_array, [["a"]], {}, "not texts"),
    (real_array, ["0.1"], {}, "value '0.1'.*remove the quotes"),
    (real_array, [np.ma.masked_array([1.0, 2.0], [True, False])], {}, "1 masked"),
    (finite_array, [[[1, np.inf]]], {}, r"\[0, 1\].*inf"),
    (finite_array, [np.nan], {}, "nan"),
    (one_of, ["lnks", ["links"]], {}, "'lnks'.*mean 'links'"),
    (one_of, ["q", ["a", "b"]], {}, "'q'.*'a' or 'b'"),
    (one_of, [1, ["a", "b"]], {}, "1.*'a' or 'b'"),
]


def test_what_is_wrong_is_named_with_its_value_and_what_is_needed():
    for check, arguments, bounds, words in BAD:
        with row(check.__name__, *arguments), pytest.raises(PlanningError, match=f"^x.*{words}"):
            check("x", *arguments, PlanningError, **bounds)


def test_what_is_sound_comes_back():
    assert number("x", np.float32(2), ValueError, above=0) == 2.0
    assert number("x", 0, ValueError, least=0) == number("x", 0.0, ValueError, least=0) == 0.0
    assert number("x", 1, ValueError, most=1) == number("x", 1.0, ValueError, most=1) == 1.0
    assert [whole_number("x", k, ValueError, least=1, most=9) for k in (1, np.int8(9))] == [1, 9]
    np.testing.assert_array_equal(numbers("x", 2, 3, ValueError), [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(numbers("x", [0, 2, 3], 3, ValueError, least=0), [0, 2, 3])
    assert np.isnan(real_array("x", [np.nan])).all()
    whole = np.ones(2)
    assert real_array("x", whole) is whole
    assert real_array("x", [1, 2]).dtype == finite_array("x", [[1, 2]]).dtype == np.float64
    assert one_of("x", "a", {"a": 1}, ValueError) == "a"
    assert did_you_mean("zzz", ["links"]) == did_you_mean(1, ["links"]) == ""


def test_values_are_shown_on_one_line_that_is_not_long():
    assert shown("a\nb") == repr("a\nb") and shown(np.zeros((2, 1))) == "array([[0.], [0.]])"
    assert [len(shown("x" * k)) for k in (198, 199)] == [200, 200]
    assert shown("x" * 198).endswith("x'") and shown("x" * 199).endswith("...")
    assert shown(10**5000) == "of type int, too long to show"


# Files.

WRITERS = {
    "run.npz": lambda motion, path: motion.save(path),
    "run.nc": lambda motion, path: dataclasses.replace(motion, model=None).to_netcdf(path),
    "times.svg": lambda motion, path: motion.plot(path=path),
    "times.png": lambda motion, path: motion.plot(path=path),
    "film.pdf": lambda motion, path: motion.film(path),
    "film.gif": lambda motion, path: motion.film(path, speed=2.0),
}
OLD = b"what was there before"
QUICK = ("run.npz", "run.nc", "film.gif")  # drawings take long
DRAWN = ("times.svg", "times.png", "film.pdf")


def unchanged(folder, name):
    """Nothing but the old file is there."""
    assert [path.name for path in folder.iterdir()] == [name]
    assert (folder / name).read_bytes() == OLD


@pytest.mark.parametrize("names", [QUICK, pytest.param(DRAWN, marks=pytest.mark.slow)])
def test_a_name_that_cannot_be_given_leaves_the_old_file(names, monkeypatch, tmp_path):
    """What is no error of the system, as a stop by the user, is passed on as it is."""
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    for name in names:
        path = tmp_path / name
        path.write_bytes(OLD)
        for reason in (full, KeyboardInterrupt(), ZeroDivisionError()):
            monkeypatch.setattr(os, "replace", mock.Mock(side_effect=reason))
            expected = st.NotWritten if reason is full else type(reason)
            with row(name, reason), pytest.raises(expected) as caught:
                WRITERS[name](flight(samples=20), path)
            told = str(caught.value)
            assert reason is not full or (str(path) in told and full.strerror in told), told
            unchanged(tmp_path, name)
        path.unlink()


def test_a_path_that_cannot_be_is_told(tmp_path):
    (tmp_path / "file").write_bytes(OLD)
    (tmp_path / "run.npz").mkdir()
    for place, words in {
        "run.npz": "Is a directory",
        "file/run.npz": r"file.*is not written",
        "a\0b.npz": r"^'[^\n]*NUL",
        "a\0b/c.npz": r"^'[^\n]*NUL",
    }.items():
        with row(place), pytest.raises(st.NotWritten, match=words):
            flight(samples=20).save(tmp_path / place)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "run.npz"]
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


def put(path, content):
    with replacing(path) as part:
        part.write_bytes(content)


def listed(folder):
    return sorted(path.name for path in folder.iterdir())


def test_links_are_followed(tmp_path):
    """To a file, and to one that is still to be made, in another folder."""
    (tmp_path / "far").mkdir()
    for name, target in {"near": "far/old", "later": "far/new", "again": "near"}.items():
        (tmp_path / name).symlink_to(target)
    (tmp_path / "far" / "old").write_bytes(OLD)
    for name, target in {"near": "old", "later": "new", "again": "old"}.items():
        put(tmp_path / name, name.encode())
        with row(name):
            assert (tmp_path / "far" / target).read_bytes() == name.encode()
            assert (tmp_path / name).is_symlink() and listed(tmp_path / "far")[-1] == "old"
    assert listed(tmp_path) == ["again", "far", "later", "near"]


def test_a_pipe_and_a_device_stay_and_get_the_content(tmp_path):
    pipe, got = tmp_path / "pipe.csv", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()), daemon=True)
    reader.start()
    for path in (pipe, tmp_path / "file.csv"):
        KILLED["run.csv"](flight(samples=20), path)
    reader.join(10)
    assert got == [(tmp_path / "file.csv").read_bytes()]
    assert stat.S_ISFIFO(os.stat(pipe).st_mode) and listed(tmp_path) == ["file.csv", "pipe.csv"]
    ours, theirs = pty.openpty()  # of the devices the one that no other program uses
    with closing(os.fdopen(ours, "rb", 0)) as terminal, closing(os.fdopen(theirs, "wb")):
        tty.setraw(theirs)
        device = Path(os.ttyname(theirs))
        put(device, b"words")
        assert terminal.read(9) == b"words" and device.is_char_device()


def test_parts_of_the_dead_go_after_a_minute_and_those_in_use_stay(tmp_path):
    """Of a file that has another name, too; what only looks like a part stays."""
    ages = {".a.npz.01234567.part": 59, ".b.csv.89abcdef.part": 61, ".c.0123456.part": 61}
    ages |= {"d.01234567.part": 61, ".held.00000000.part": 61}
    for name, seconds in ages.items():
        (tmp_path / name).write_bytes(OLD)
        os.utime(tmp_path / name, (time.time() - seconds,) * 2)
    with (tmp_path / ".held.00000000.part").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        put(tmp_path / "run", b"new")
        assert listed(tmp_path) == sorted({*ages, "run"} - {".b.csv.89abcdef.part"})
    put(tmp_path / "run", b"new")
    assert listed(tmp_path) == sorted(
        {*ages, "run"} - {".b.csv.89abcdef.part", ".held.00000000.part"}
    )
    with mock.patch("serpentail_scene.posix.fcntl", None):  # as on Windows
        age(tmp_path)
        put(tmp_path / "run", b"newer")
    assert (tmp_path / "run").read_bytes() == b"newer"
    with replacing(tmp_path / "run"):  # a part is held while it is written, however long it takes
        age(tmp_path)
        put(tmp_path / "other", b"new")
        assert len([name for name in listed(tmp_path) if name.startswith(".run.")]) == 1


def test_content_is_on_the_disk_before_the_name_and_the_name_before_the_end(tmp_path, monkeypatch):
    path, synced = tmp_path / "run", []
    path.write_bytes(OLD)

    def fsync(handle):
        kind = "folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else "file"
        synced.append((kind, path.read_bytes()))

    monkeypatch.setattr(os, "fsync", fsync)
    put(path, b"new")
    assert synced == [("file", OLD), ("folder", b"new")]


def test_a_full_disk_keeps_the_old_file(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for name, write in KILLED.items():
        (tmp_path / name).write_bytes(OLD)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
        try:
            with row(name), pytest.raises(st.SerpentailError, match=f"{name}.*not written .*make"):
                write(flight(samples=20), tmp_path / name)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        unchanged(tmp_path, name)
        (tmp_path / name).unlink()


KILLED = {
    "run.npz": WRITERS["run.npz"],
    "run.csv": lambda motion, path: dataclasses.replace(motion, model=None).to_csv(path),
    "run.html": st.view,
}


def test_a_kill_leaves_the_old_file_and_nothing_after_the_next_write(tmp_path):
    """At each of the last 20 calls of the file system, the old file or the new one is there."""
    for name, write in KILLED.items():
        path, calls = tmp_path / name, []
        work = partial(write, flight(samples=20), path)
        work()
        new = path.read_bytes()
        with before_calls(partial(calls.append, 1)):
            work()
        for moment in range(len(calls) - 20, len(calls)):
            path.write_bytes(OLD)
            with row(name, moment):
                assert killed_at(moment, work)
                assert path.read_bytes() in (OLD, new)
                age(tmp_path)
                put(tmp_path / "next", b"")
                assert listed(tmp_path) == sorted([name, "next"])
        path.unlink()
        (tmp_path / "next").unlink()

"""The cache has a size, by which what nobody uses goes; a command tells what is in it."""

import ctypes
import json
import os
import time

import pytest

import serpentail as st
from serpentail import cli
from serpentail.model import bound, compiler
from tests.support.file_faults import HOUR, age

from ...support.rows import row
from .conftest import TWICE, call_twice

STATE = [0, 0, 0, 1, 0, 0, 0, 0.3, -0.2], [0.5] * 8, [0.1, 0.2]


def built(model, number):
    """The library of a text of its own."""
    (source,), include = model
    source.write_text(f"{TWICE}int number = {number};\n")
    return compiler.compile_library([source], include)


def used(path, hours):
    """Let an entry be used last so many hours ago."""
    then = time.time() - hours * HOUR
    os.utime(path, (then, then))


def size(entry):
    return sum(path.stat().st_size for path in entry.iterdir())


def test_what_was_not_used_for_longest_goes(model, cache, monkeypatch):
    entries = [built(model, number).parent for number in range(4)]
    for hours, entry in zip((20, 9, 2, 5), entries, strict=True):
        used(entry, hours)
    built(model, 0)  # used now
    monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", str(int(4.5 * size(entries[0]))))
    last = built(model, 4).parent
    assert [entry.exists() for entry in entries] == [True, False, True, True] and last.exists()
    assert not list((cache / "parts").iterdir())


def test_what_is_in_use_stays(model, monkeypatch):
    monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", "1")
    libraries = [built(model, number) for number in range(3)]
    assert [call_twice(library) for library in libraries] == [42.0] * 3
    for library in libraries:
        used(library.parent, 1)
    assert built(model, 4).exists() and not any(library.exists() for library in libraries)


def test_parts_of_killed_builds_go(model, cache):
    built(model, 0)
    lost, mine = cache / "parts" / ("0" * 24), cache / "parts" / "mine"
    for path in (lost, mine):
        path.mkdir()
        (path / "library.part").write_text("half")
    built(model, 1)
    assert lost.exists()
    age(cache / "parts")
    built(model, 2)
    assert not lost.exists() and mine.exists()


def test_sizes_and_what_is_none(model, monkeypatch):
    for text, size in {"": 2**30, "17": 17, "500M": 500 * 2**20, "2g": 2**31}.items():
        monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", text)
        assert bound.limit() == size, text
    for text in ("much", "-1", "1.5G", "1 G B", "\u0663"):
        monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", text)
        with row(text), pytest.raises(st.SerpentailError, match=r"SERPENTAIL_CACHE_SIZE: value"):
            built(model, 0)


# The command


def test_command_tells_and_empties(model, cache, capsys):
    libraries = [built(model, number) for number in range(2)]
    loaded = ctypes.CDLL(str(libraries[0]))
    assert cli.main(["cache", "--json", "-"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report.pop("bytes") > sum(library.stat().st_size for library in libraries)
    counts = {"libraries": 2, "models": 0, "builds": 0, "compilers": 1}
    assert report == {"folder": str(cache), **counts, "limit": 2**30}
    (cache / "mine.txt").touch()
    (cache / "libraries" / "mine").mkdir()

    assert cli.main(["cache", "--clean"]) == 0
    rows = dict(line.split(None, 1) for line in capsys.readouterr().out.splitlines())
    none = dict.fromkeys(counts, "0")
    assert rows == {"folder": str(cache), **none, "bytes": "0", "limit": str(2**30)}
    left = {path.relative_to(cache).as_posix() for path in cache.rglob("*")}
    folders = {"libraries", "compilers", "locks", "parts"}
    assert left == {*folders, "mine.txt", "libraries/mine"}
    loaded.twice.restype, loaded.twice.argtypes = ctypes.c_double, [ctypes.c_double]
    assert loaded.twice(21.0) == 42.0

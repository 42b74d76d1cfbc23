"""A generated folder is written whole or not at all: kills, full disks and rivals at any moment."""

import errno
import itertools
import json
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from serpentail.model.manifest import read_folder
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.targets import write
from serpentail_codegen.targets.write import write_folder
from tests.support.file_faults import age, at, before_calls, fault, killed_at
from tests.support.models import model_folder
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
OLD = {"a.txt": "old", "src/b.c": "old", "src/same.c": "same", "gone/c.c": "old"}
NEW = {"a.txt": "new", "src/b.c": "new", "src/same.c": "same", "include/d.h": "new"}
MINE = {"build/deep/mine.o": "mine", ".made": ""}


def furnished(folder):
    """An old generation, and files of its user."""
    write_folder(folder, OLD, {"name": "old"})
    for name, text in MINE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    (folder / "build" / "empty").mkdir()
    (folder / "build" / "link").symlink_to("deep")
    return folder


@pytest.fixture
def folder(tmp_path):
    return furnished(tmp_path / "root" / "folder")


def texts(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*")
        if path.is_file() and "link" not in path.parts
    }


def is_whole(folder, files, name):
    """Tell whether a folder has these files, its user's, and a manifest of them."""
    found = texts(folder)
    manifest = json.loads(found.pop("manifest.json"))
    return found == {**files, **MINE} and manifest["name"] == name


def test_what_is_the_user_s_comes_along(folder):
    kept = (folder / "build/deep/mine.o").stat(), (folder / "src/same.c").stat()
    folder.chmod(0o2770)
    write_folder(folder, NEW, {"name": "new"})
    assert is_whole(folder, NEW, "new")
    assert not (folder / "gone").exists() and folder.stat().st_mode & 0o7777 == 0o2770
    assert (folder / "build" / "empty").is_dir()
    assert os.readlink(folder / "build" / "link") == "deep"
    after = (folder / "build/deep/mine.o").stat(), (folder / "src/same.c").stat()
    same = [[(s.st_mtime_ns, s.st_ino) for s in each] for each in (kept, after)]
    assert same[0] == same[1]  # of the same files: nothing is copied
    assert os.listdir(folder.parent) == ["folder"]


def test_nothing_is_written_where_nothing_changed(folder):
    def written():
        found = {path: path.lstat() for path in folder.parent.rglob("*")}
        keys = ("st_ino", "st_mtime_ns", "st_ctime_ns", "st_size")
        return {path: [getattr(s, key) for key in keys] for path, s in found.items()}

    before = written()
    assert write_folder(folder, OLD, {"name": "old"}) == []
    assert written() == before
    (folder / "src" / "b.c").unlink()
    assert write_folder(folder, OLD, {"name": "old"}) == ["src/b.c"]


def test_link_to_a_folder_stays_a_link(folder, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    link = tmp_path / "elsewhere" / "link"
    link.symlink_to(folder)
    write_folder(link, NEW, {"name": "new"})
    assert link.is_symlink() and is_whole(folder, NEW, "new")
    assert os.listdir(link.parent) == ["link"] and os.listdir(folder.parent) == ["folder"]


def test_file_systems_that_know_less(tmp_path, monkeypatch):
    less = {"exchange": (write, "_exchange", lambda *_: False)}
    less |= {"links": (os, "link", lambda *_, **__: fault(errno.EPERM)())}
    for name, patch in less.items():
        folder = furnished(tmp_path / name / "folder")
        with monkeypatch.context() as patches, row(name):
            patches.setattr(*patch)
            write_folder(folder, NEW, {"name": "new"})
            assert is_whole(folder, NEW, "new") and os.listdir(folder.parent) == ["folder"]


# Kills


def killed_generations(folder, old, new):
    """Kill a generation of the new model over the old one, at each call of the file system; return
    how many calls there are, and how often which model was left.

    After each kill the runtime reads one of both, its user's files are there, and the next
    generation leaves nothing else.
    """
    os.fsync = lambda _: None  # a kill loses nothing that was written
    checked, mine = [read_folder(source) for source in (old, new)], folder / "build" / "mine.o"
    before, after = (
        ({name: text.decode() for name, text in found.files.items()}, found.manifest)
        for found in checked
    )
    hashes, left = [found.manifest_hash for found in checked], [0, 0]
    for moment in itertools.count():
        write_folder(folder, *before)
        mine.parent.mkdir(exist_ok=True)
        mine.write_text("mine")
        killed = killed_at(moment, lambda: write_folder(folder, *after), (write, "_exchange"))
        left[hashes.index(read_folder(folder).manifest_hash)] += 1
        assert mine.read_text() == "mine", moment

        age(folder.parent)
        write_folder(folder, *after)
        assert os.listdir(folder.parent) == [folder.name], moment
        assert read_folder(folder).manifest_hash == hashes[1], moment
        assert {*os.listdir(folder)} == {*os.listdir(new), "build"}, moment
        if not killed:
            return [moment, *left]


def test_a_generation_killed_at_any_call_leaves_a_model(tmp_path):
    """Models of the fewest files, as each call that writes them is a kill; in a process without
    threads, as it forks.
    """
    options = {"name": "tail", "targets": ["casadi"]}
    sizes = [(1, ["mass_matrix"]), (2, ["mass_matrix", "energy"])]
    models = [model_folder(1, n, functions=names, **options) for n, names in sizes]
    code = "import sys, pathlib, tests.targets.test_write as test\n"
    code += "print(test.killed_generations(*map(pathlib.Path, sys.argv[1:])))"
    command = [sys.executable, "-c", code, tmp_path / "root" / "tail", *models]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    moments, old, new = json.loads(done.stdout)
    assert moments > 50 and old > new > 5


def test_parts_of_the_living_stay(folder):
    part = folder.parent / f".serpentail-{'0' * 24}.part"
    other = folder.parent / ".serpentail-mine.part"
    for path in (part, other):
        path.mkdir()
    write_folder(folder, NEW, {"name": "new"})
    assert part.exists()
    age(folder.parent)
    write_folder(folder, NEW, {"name": "new"})
    assert not part.exists() and other.exists()


# Faults


def test_fault_at_any_call_is_one_line_and_leaves_a_model(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda _: None)  # it takes most of the time
    refused, named, full = 0, 0, fault(errno.ENOSPC)
    for moment in itertools.count():
        folder = furnished(tmp_path / str(moment) / "folder")
        came = []
        with row(moment):
            with before_calls(at(moment, lambda: came.append(1) or full())):  # noqa: B023
                try:
                    write_folder(folder, NEW, {"name": "new"})
                except SceneError as error:
                    refused += 1
                    named += os.strerror(errno.ENOSPC) in str(error)
                    assert "\n" not in str(error)
                    assert str(error).startswith("generated folder: value '")
            assert is_whole(folder, OLD, "old") or is_whole(folder, NEW, "new")
            age(folder.parent)
            write_folder(folder, NEW, {"name": "new"})
            assert is_whole(folder, NEW, "new") and os.listdir(folder.parent) == ["folder"]
        if not came:
            break
    # when it copies a link, Python goes on after a fault and reports the next one
    assert moment > 60 and refused > 20 and named >= refused - 2


# Rivals


def in_threads(work):
    """Do some work in eight threads at once; errors are raised."""
    together = threading.Barrier(8)

    def run(number):
        together.wait()
        for turn in range(5):
            work(number + turn)

    with ThreadPoolExecutor(8) as pool:
        assert [*pool.map(run, range(8))] == [None] * 8


def test_eight_threads_write_one_model(folder, tmp_path, monkeypatch):
    for name in ("at once", "in steps"):
        place = tmp_path / name / "folder"
        with row(name), monkeypatch.context() as patches:
            if name == "in steps":
                patches.setattr(write, "_exchange", lambda *_: False)
            in_threads(lambda n, place=place: write_folder(place, {**OLD, "n": str(n % 4)}, {}))
            assert {*texts(place)} == {*OLD, "n", "manifest.json"}
            assert os.listdir(place.parent) == ["folder"]

    # threads that write different models leave one
    models = (NEW, {"name": "new"}), (OLD, {"name": "old"})
    in_threads(lambda number: write_folder(folder, *models[number % 2]))
    assert is_whole(folder, OLD, "old") or is_whole(folder, NEW, "new")
    assert os.listdir(folder.parent) == ["folder"]

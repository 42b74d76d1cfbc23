"""A generated folder is written whole or not at all: kills, full disks and rivals at any moment."""

import errno
import itertools
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from serpentail_codegen.__main__ import main
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.targets import exchange
from serpentail_codegen.targets.write import write_folder
from tests.support.file_faults import age, at, before_calls, fault
from tests.support.models import model_folder

ROOT = Path(__file__).parents[2]
OLD = {"a.txt": "old", "src/b.c": "old", "src/same.c": "same", "gone/c.c": "old"}
NEW = {"a.txt": "new", "src/b.c": "new", "src/same.c": "same", "include/d.h": "new"}
MINE = {"build/deep/mine.o": "mine", ".made": ""}
THREADS = 8


@pytest.fixture
def folder(tmp_path):
    """An old generation, and files of its user."""
    return furnished(tmp_path / "root" / "folder")


def furnished(folder):
    write_folder(folder, OLD, {"name": "old"})
    for name, text in MINE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    (folder / "build" / "empty").mkdir(exist_ok=True)
    if not (folder / "build" / "link").is_symlink():
        (folder / "build" / "link").symlink_to("deep")
    return folder


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
    assert [s.st_mtime_ns for s in after] == [s.st_mtime_ns for s in kept]
    assert os.listdir(folder.parent) == ["folder"]


def written(folder):
    """What writing changes of all files: which they are, their times of writing, their sizes."""
    found = {path: path.lstat() for path in folder.rglob("*")}
    return {path: (s.st_ino, s.st_mtime_ns, s.st_ctime_ns, s.st_size) for path, s in found.items()}


def test_nothing_is_written_where_nothing_changed(folder):
    before = written(folder.parent)
    assert write_folder(folder, OLD, {"name": "old"}) == []
    assert written(folder.parent) == before
    (folder / "src" / "b.c").unlink()
    assert write_folder(folder, OLD, {"name": "old"}) == ["src/b.c"]


def test_link_to_a_folder_stays_a_link(folder, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    link = tmp_path / "elsewhere" / "link"
    link.symlink_to(folder)
    write_folder(link, NEW, {"name": "new"})
    assert link.is_symlink() and is_whole(folder, NEW, "new")
    assert os.listdir(link.parent) == ["link"] and os.listdir(folder.parent) == ["folder"]


@pytest.mark.parametrize("without", ["exchange", "links"])
def test_file_systems_that_know_less(folder, monkeypatch, without):
    if without == "exchange":
        monkeypatch.setattr(exchange, "_system_call", lambda: None)
    else:
        monkeypatch.setattr(os, "link", lambda *_, **__: fault(errno.EPERM)())
    write_folder(folder, NEW, {"name": "new"})
    assert is_whole(folder, NEW, "new") and os.listdir(folder.parent) == ["folder"]


# Kills


@pytest.mark.parametrize(
    "targets", [["casadi"], pytest.param(["c", "casadi"], marks=pytest.mark.slow)], ids=str
)
def test_a_generation_killed_at_any_call_leaves_a_model(tmp_path, targets):
    options = {"name": "tail", "targets": targets}
    old = model_folder(1, 1, functions=["mass_matrix"], **options)
    new = model_folder(1, 2, functions=["mass_matrix", "energy"], **options)
    program = [sys.executable, "-m", "tests.targets.killed_generations"]
    command = [*program, str(tmp_path / "root" / "tail"), str(old), str(new)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    found = json.loads(done.stdout)
    print(found)
    assert found["moments"] > 50 and found["old"] > found["new"] > 5


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


@pytest.mark.parametrize(
    "code",
    [
        errno.ENOSPC,
        *(pytest.param(code, marks=pytest.mark.slow) for code in (errno.EFBIG, errno.EIO)),
    ],
    ids=errno.errorcode.get,
)
def test_fault_at_any_call_is_one_line_and_leaves_a_model(tmp_path, code, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda _: None)  # it takes most of the time
    refused = 0
    for moment in itertools.count():
        folder = furnished(tmp_path / str(moment) / "folder")
        came = []
        with before_calls(at(moment, lambda: came.append(1) or fault(code)())):  # noqa: B023
            try:
                write_folder(folder, NEW, {"name": "new"})
            except SceneError as error:
                refused += 1
                assert os.strerror(code) in str(error) and "\n" not in str(error), moment
                assert str(error).startswith("generated folder: value '"), moment
        assert is_whole(folder, OLD, "old") or is_whole(folder, NEW, "new"), moment
        age(folder.parent)
        write_folder(folder, NEW, {"name": "new"})
        assert is_whole(folder, NEW, "new") and os.listdir(folder.parent) == ["folder"], moment
        if not came:
            break
    print(f"{moment} calls, {refused} of them refused")
    assert moment > 60 and refused > 20


def test_command_line_says_it_in_one_line(tmp_path, capsys):
    (tmp_path / "file").touch()
    arguments = ["--tail", "articulated", "--segments", "1", "--links", "1"]
    arguments += ["--functions", "mass_matrix", "--output", str(tmp_path / "file")]
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert err.startswith("generated folder: value '") and "cannot be written (Not a dir" in err


# Rivals


def in_threads(work):
    """Do some work in eight threads at once; return the errors."""
    errors, together = [], threading.Barrier(THREADS)

    def run(number):
        together.wait()
        try:
            for turn in range(5):
                work(number + turn)
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(number,)) for number in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return errors


@pytest.mark.parametrize("step", [None, "in steps"])
def test_eight_threads_write_one_model(tmp_path, monkeypatch, step):
    if step:
        monkeypatch.setattr(exchange, "_system_call", lambda: None)
    folder = tmp_path / "root" / "folder"
    assert in_threads(lambda number: write_folder(folder, {**OLD, "n": str(number % 4)}, {})) == []
    found = texts(folder)
    assert {*found} == {*OLD, "n", "manifest.json"} and os.listdir(folder.parent) == ["folder"]


def test_threads_that_write_different_models_leave_one(folder):
    def work(number):
        write_folder(folder, *((OLD, {"name": "old"}) if number % 2 else (NEW, {"name": "new"})))

    assert in_threads(work) == []
    assert is_whole(folder, OLD, "old") or is_whole(folder, NEW, "new")
    assert os.listdir(folder.parent) == ["folder"]

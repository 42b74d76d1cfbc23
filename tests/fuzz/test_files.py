"""Whatever is in a file from a stranger, it is read, or refused in one line: no traceback, no
signal, no endless work, no memory without bound.
"""

import contextlib
import faulthandler
import os
import resource
import subprocess
import tempfile
import warnings
from pathlib import Path

import ezc3d  # noqa
import pytest

import serpentail as st
from serpentail.bridges.sweeps.scene import arguments_of
from serpentail.bridges.sweeps.store import Row
from serpentail.bridges.sweeps.sweep import posed
from serpentail.cli import cli
from serpentail.identification import c3d, c3d_child
from serpentail.scenes.file import read_scene, subtable
from serpentail.scenes.identify import identify_arguments
from serpentail.scenes.plan import plan_arguments
from serpentail_codegen.__main__ import parser, scene_of
from serpentail_codegen.scene.parse import load_scene
from serpentail_codegen.scene.problems import SceneError
from tests.identification.test_c3d import c3d as c3d_of
from tests.identification.test_files import some
from tests.support import swept, zoo
from tests.support.rows import row
from tests.support.scenes import SCENES, VALID

from .conftest import in_time
from .mutants import mutants

MEMORY = 2**30  # bytes that a read may need
ERRORS = st.SerpentailError
SWEEP = """[sweep]
points = 8
seed = 3
limit = 2.5
outputs = ["end_s", "q_end"]
store = "study.rows"
[sweep.over]
tail_mass = {grid = ["2 g", 3e-3]}
"start.pitch" = {random = [-1.0, "1 rad"], law = "uniform"}
duration = [0.1, 0.2]
"""
OVER = {"x": st.grid(range(20)), "word": st.grid(["a", "b"])}


def stored(path):
    rows = [Row(k, '{"square":4.0}' if k else None, None if k else "no", 0.1) for k in range(40)]
    store = posed(None, OVER, swept.square, path).store
    with store.writing():
        store.accept(rows)


def rows_of(path):
    found = posed(None, OVER, swept.square, path)
    with found.store.writing():
        return found.rows()


def motion(path):
    model, q = zoo.model("m1_n1"), [0, 0, 0.3, 1, 0, 0, 0, 0, 0]
    return st.simulate(model, q, [0] * 8, t_span=0.01).save(path)


def packaged(path):
    path.write_bytes((SCENES / path.name).read_bytes())


def swept_scene(path):
    path.write_text(VALID + SWEEP)


def read_by(read, name):
    return lambda path: read(
        subtable(read_scene(path, st.ModelError)[0], name, path, st.ModelError)
    )


def forked(command, **_):
    """In place of a process that is begun for each of many files."""
    *_, path, memory, seconds = command
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        faulthandler.disable()  # signals are expected here
        quiet, ended = os.open(os.devnull, os.O_WRONLY), 1
        os.dup2(quiet, 1), os.dup2(quiet, 2)
        try:
            with open(write, "wb") as answer:
                c3d_child.main(path, int(memory), int(seconds), answer)
            ended = 0
        finally:
            os._exit(ended)
    os.close(write)
    with open(read, "rb") as answer:
        said = answer.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return subprocess.CompletedProcess(command, status, said)


MARKERS = (lambda path: st.write_markers(some(), path), lambda path: st.read_markers(path, None))
FORMATS = {  # how a file is made and read, and the errors that say what is wrong
    "run.trc": (*MARKERS, ValueError),
    "run.csv": (MARKERS[0], lambda path: st.read_markers(path, "m"), ValueError),
    "run.c3d": (lambda path: c3d_of(some(), path), MARKERS[1], ValueError),
    "run.npz": (motion, st.Trajectory.load, ValueError),
    "study.rows": (stored, rows_of, ERRORS),
    "kick_and_land.toml": (packaged, lambda path: st.scenario(path, zoo.folder("ground")), ERRORS),
    "righting_m1_n3.toml": (packaged, read_by(plan_arguments, "plan"), ERRORS),
    "identify_tail.toml": (packaged, read_by(identify_arguments, "identify"), ERRORS),
    "sweep.toml": (swept_scene, arguments_of, ERRORS),
    "mixed_tail.toml": (packaged, load_scene, SceneError),
}


@contextlib.contextmanager
def bounded():
    """Refuse memory beyond what this process has and a read may need."""
    usual = resource.getrlimit(resource.RLIMIT_AS)
    with open("/proc/self/statm") as told:
        has = int(told.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (has + MEMORY, usual[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, usual)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("many", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_any_file_is_read_or_refused_in_a_line(name, many, tmp_path, monkeypatch):
    make, read, refusals = FORMATS[name]
    if name == "run.c3d":
        pytest.importorskip("ezc3d")  # once, not in each fork
        monkeypatch.setattr(c3d.subprocess, "run", forked)
        monkeypatch.setattr(c3d, "SECONDS", 1)
        many = 50 if many == 100 else many  # each is a fork
    make(tmp_path / name)
    read(tmp_path / name)
    content, refused = (tmp_path / name).read_bytes(), 0
    for k, mutant in enumerate(mutants(content, many)):
        with (
            row(f"mutant {k}: {mutant[:2000]!r}"),
            tempfile.TemporaryDirectory(dir=tmp_path) as folder,
            in_time(),
            bounded(),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore", st.UnusualSize)
            path = Path(folder) / name
            path.write_bytes(mutant)
            try:
                read(path)
            except refusals as error:
                refused += 1
                for line in str(error).splitlines():
                    assert line.isprintable() and 10 < len(line) < 2000, line
    assert refused > many // 4


def generated(path):
    """Read a scene as the generator's command does, up to the derivation."""
    with contextlib.suppress(SceneError):
        scene_of(parser().parse_args([str(path)]))


@pytest.mark.parametrize("many", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_commands_read_or_refuse_any_scene_in_words(many, tmp_path, capsys):
    """The folder has no model, so `simulate` and `plan` must refuse each of them."""
    path, empty = tmp_path / "damaged.toml", tmp_path / "empty"
    empty.mkdir()
    scenes = sorted(SCENES.glob("*.toml"))
    for scene in scenes:
        for mutant in mutants(scene.read_bytes(), -(-many // len(scenes))):
            path.write_bytes(mutant)
            with row(scene.name, mutant[:2000]), in_time(), warnings.catch_warnings():
                warnings.simplefilter("ignore", st.UnusualSize)
                generated(path)
                for verb in ("plan", "simulate"):
                    assert cli.main([verb, str(path), "--folder", str(empty)]) == 2
                    assert capsys.readouterr().err.strip()

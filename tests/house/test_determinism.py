"""Generated folders are a function of the scene: same bytes, nothing written twice, never half a
file.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.targets import write
from serpentail_codegen.targets.write import digest, write_folder
from tests.support.told import besides_progress

OPTIONS = {"functions": ["forward_dynamics", "tail_points", "rollout"], "emission": "loops"}
NAME = "articulated_m2_n2"
HEADER, UNCHECKED = f"include/{NAME}.h", f"include/{NAME}_unchecked.h"
MODEL, HOST = f"src/{NAME}.c", f"src/{NAME}_host.c"
BATCH, FLIGHTS = f"src/{NAME}_batch.c", f"src/{NAME}_flights.c"
EXAMPLE, CASADI, MANIFEST = "example/main.c", f"{NAME}_casadi.py", "manifest.json"
PACKAGE = {"Makefile", "CMakeLists.txt", "LICENSE", "README.md"}
SIMULATION = {f"include/{NAME}_simulation.h", f"src/{NAME}_simulation.c"}
FILES = {
    HEADER,
    UNCHECKED,
    MODEL,
    HOST,
    BATCH,
    FLIGHTS,
    *SIMULATION,
    EXAMPLE,
    CASADI,
    MANIFEST,
    *PACKAGE,
}


def scene(**options):
    """The scene of these tests, with other options."""
    return scene_for("articulated", 2, 2, **OPTIONS | options)


def texts(folder):
    """Every file below a folder by its name, as bytes."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture
def expected(tmp_path):
    """What the scene generates."""
    changed = generate(scene(), tmp_path / "expected")
    assert set(changed) == FILES and len(changed) == len(FILES)
    return texts(tmp_path / "expected" / NAME)


def call(*arguments, cwd, **surroundings):
    """Generate in a process of its own; return what it printed."""
    command = [sys.executable, "-m", "serpentail_codegen", *arguments]
    codegen = str(Path(write.__file__).parents[1])
    path = os.pathsep.join([codegen, os.environ.get("PYTHONPATH", "")])
    env = {**os.environ, "PYTHONPATH": path, **surroundings}
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, check=False)
    assert (done.returncode, besides_progress(done.stderr)) == (0, "")
    return done.stdout


def test_same_bytes_twice(expected, tmp_path):
    assert set(expected) == FILES
    generate(scene(), tmp_path / "again")
    assert texts(tmp_path / "again" / NAME) == expected


@pytest.mark.parametrize("seed", "0123")
def test_same_bytes_under_any_hash_seed_and_from_any_folder(expected, tmp_path, seed):
    cwd = tmp_path / f"elsewhere{seed}"
    cwd.mkdir()
    functions = ",".join(reversed(OPTIONS["functions"]))
    tail = ("--tail", "articulated", "--segments", "2", "--links", "2", "--emission", "loops")
    surroundings = {"PYTHONHASHSEED": seed, "LC_ALL": "C", "TZ": f"Etc/GMT+{seed}"}
    printed = call(
        *tail,
        *("--functions", functions, "--name", NAME, "--output", "made/here"),
        cwd=cwd,
        **surroundings,
    )
    assert f"made/here/{NAME}: {len(FILES)} files written" in printed
    assert texts(cwd / "made" / "here" / NAME) == expected


def test_texts_tell_nothing_of_where_and_when(expected, tmp_path):
    for name, text in expected.items():
        assert (
            str(tmp_path).encode() not in text and str(Path.home()).encode() + b"/" not in text
        ), name
        assert not re.search(rb"\b20\d\d-\d\d-\d\d|\b\d\d:\d\d:\d\d\b", text), name


def test_second_generation_writes_nothing(expected, tmp_path):
    folder = tmp_path / "expected" / NAME
    before = {path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in folder.rglob("*")}
    assert generate(scene(), tmp_path / "expected") == []
    assert {
        path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in folder.rglob("*")
    } == before
    assert texts(folder) == expected


def test_lost_and_edited_files_are_restored(expected, tmp_path):
    folder = tmp_path / "expected" / NAME
    (folder / MODEL).write_text("edited")
    (folder / HEADER).unlink()
    assert set(generate(scene(), tmp_path / "expected")) == {MODEL, HEADER}
    assert texts(folder) == expected


def differing_lines(some, other):
    """Pairs of lines that differ between two texts of equal length."""
    lines = some.decode().splitlines(), other.decode().splitlines()
    return [pair for pair in zip(*lines, strict=True) if pair[0] != pair[1]]


def test_a_parameter_changes_only_its_value_and_the_hash(expected, tmp_path):
    changed = generate(scene(parameters={"gravity": 1.62}), tmp_path / "expected")
    assert set(changed) == {HEADER, MODEL, CASADI, MANIFEST}
    now = texts(tmp_path / "expected" / NAME)
    assert differing_lines(expected[MODEL], now[MODEL]) == [
        ("  parameters->gravity = 9.8;", "  parameters->gravity = 1.62;")
    ]
    before, after = (json.loads(some[MANIFEST])["content_hash"] for some in (expected, now))
    for name in (HEADER, CASADI):
        pairs = differing_lines(expected[name], now[name])
        assert pairs and all(old.replace(before, after) == new for old, new in pairs)


def test_a_baked_parameter_changes_only_the_code_and_the_hash(tmp_path):
    generate(scene(baked=True), tmp_path)
    changed = generate(scene(baked=True, parameters={"gravity": 1.62}), tmp_path)
    assert set(changed) == {HEADER, MODEL, BATCH, FLIGHTS, CASADI, MANIFEST}


def test_manifest_describes_the_files(expected):
    manifest = json.loads(expected[MANIFEST])
    assert manifest["files"] == {
        name: digest(expected[name].decode()) for name in sorted(FILES - {MANIFEST})
    }
    for name in (HEADER, CASADI):
        assert manifest["content_hash"] in expected[name].decode()
    assert f'return "{manifest["abi_hash"]}";' in expected[HOST].decode()


def hashes(root, **options):
    """The two hashes of a scene's manifest."""
    generate(scene(**options), root)
    manifest = json.loads((root / NAME / MANIFEST).read_text())
    return manifest["content_hash"], manifest["abi_hash"]


def test_hashes_tell_what_changed(tmp_path):
    content, abi = hashes(tmp_path)
    assert hashes(tmp_path) == (content, abi)
    other, same = hashes(tmp_path, parameters={"gravity": 1.62})
    assert other != content and same == abi
    contents, abis = zip(
        *(
            hashes(tmp_path, **o)
            for o in ({"real": "float"}, {"functions": ["energy"]}, {"emission": "straight"})
        ),
        strict=True,
    )
    assert len({content, other, *contents}) == 5
    assert len({abi, *abis}) == 4


def test_files_of_an_earlier_generation_go_and_others_stay(tmp_path):
    folder = tmp_path / "folder"
    write_folder(folder, {"a.txt": "a", "deep/b.txt": "b"}, {})
    (folder / "mine.txt").write_text("mine")
    assert set(write_folder(folder, {"a.txt": "a", "c.txt": "c"}, {})) == {"c.txt", "manifest.json"}
    assert set(texts(folder)) == {"a.txt", "c.txt", "manifest.json", "mine.txt"}


@pytest.mark.parametrize(
    "manifest",
    [
        "",
        "{",
        "[]",
        "{}",
        '{"files": 3}',
        "null",
        '{"files": {"../outside.txt": "", "/outside.txt": "", "lost": ""}}',
    ],
)
def test_damaged_manifest_does_no_harm(tmp_path, manifest):
    folder, outside = tmp_path / "folder", tmp_path / "outside.txt"
    folder.mkdir()
    outside.write_text("outside")
    (folder / "manifest.json").write_text(manifest)
    write_folder(folder, {"a.txt": "a"}, {})
    assert set(texts(folder)) == {"a.txt", "manifest.json"}
    assert outside.read_text() == "outside"


def test_text_is_compared_byte_by_byte(tmp_path):
    write_folder(tmp_path / "folder", {"text": "a\n"}, {})
    path = tmp_path / "folder" / "text"
    path.write_bytes(b"a\r\n")
    assert write_folder(path.parent, {"text": "a\n"}, {}) == ["text"]
    assert path.read_bytes() == b"a\n"
    assert not write_folder(path.parent, {"text": "a\n"}, {})
    assert write_folder(path.parent, {"text": "\u00e4"}, {}) == ["text", "manifest.json"]
    assert path.read_bytes() == "\u00e4".encode()

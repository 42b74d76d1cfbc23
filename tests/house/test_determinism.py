"""Generated folders are a function of the scene: same bytes, written once, never half a file."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.targets import write
from serpentail_codegen.targets.write import write_folder
from tests.house.test_golden import texts
from tests.support.rows import row

# the generator's own output is the point, so these models are made here, and none is compiled
OPTIONS = {"functions": ["forward_dynamics", "tail_points", "rollout"], "emission": "loops"}
NAME = "articulated_m2_n2"
HEADER, MODEL = f"include/{NAME}.h", f"src/{NAME}.c"
BATCH, FLIGHTS = f"src/{NAME}_batch.c", f"src/{NAME}_flights.c"
CASADI, MANIFEST = f"{NAME}_casadi.py", "manifest.json"
FILES = {HEADER, MODEL, BATCH, FLIGHTS, CASADI, MANIFEST, "example/main.c"}
FILES |= {f"src/{NAME}_host.c", f"include/{NAME}_unchecked.h", f"include/{NAME}_simulation.h"}
FILES |= {f"src/{NAME}_simulation.c", "Makefile", "CMakeLists.txt", "LICENSE", "README.md"}


def made_in(root, **options):
    """Generate the scene of these tests with other options; return what was written."""
    return generate(scene_for("articulated", 2, 2, **OPTIONS | options), root)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """What the scene generates, made once: no test writes to it."""
    root = tmp_path_factory.mktemp("made")
    changed = made_in(root)
    assert set(changed) == FILES and len(changed) == len(FILES)
    return root / NAME


def test_same_bytes_under_another_hash_seed_and_from_another_folder(made, tmp_path):
    tail = "--tail articulated --segments 2 --links 2 --emission loops"
    functions = ",".join(reversed(OPTIONS["functions"]))
    own = ("--functions", functions, "--name", NAME, "--output", "made/here")
    path = os.pathsep.join([str(Path(write.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    env = os.environ | {"PYTHONPATH": path, "PYTHONHASHSEED": "1", "LC_ALL": "C", "TZ": "Etc/GMT+3"}
    command = [sys.executable, "-m", "serpentail_codegen", *tail.split(), *own]
    printed = subprocess.check_output(command, cwd=tmp_path, env=env, text=True)
    assert f"made/here/{NAME}: {len(FILES)} files written" in printed
    assert texts(tmp_path / "made" / "here" / NAME) == texts(made)
    for name, text in texts(made).items():  # which tell nothing of where and when
        with row(name):
            assert str(made.parent) not in text and f"{Path.home()}/" not in text
            assert not re.search(r"\b20\d\d-\d\d-\d\d|\b\d\d:\d\d:\d\d\b", text)


def test_only_what_is_lost_edited_or_changed_is_written(made, tmp_path):
    expected, root, folder = texts(made), tmp_path, tmp_path / NAME
    shutil.copytree(made, folder)
    assert made_in(root) == [] and texts(folder) == expected
    (folder / MODEL).write_text("edited")
    (folder / HEADER).unlink()
    assert set(made_in(root)) == {MODEL, HEADER} and texts(folder) == expected
    # a parameter changes only its value and the hash
    changed = made_in(root, parameters={"gravity": 1.62})
    assert set(changed) == {HEADER, MODEL, CASADI, MANIFEST}
    lines = (some[MODEL].splitlines() for some in (expected, texts(folder)))
    differing = [pair for pair in zip(*lines, strict=True) if pair[0] != pair[1]]
    assert differing == [("  parameters->gravity = 9.8;", "  parameters->gravity = 1.62;")]
    made_in(root, baked=True)
    changed = made_in(root, baked=True, parameters={"gravity": 1.62})
    assert set(changed) == {HEADER, MODEL, BATCH, FLIGHTS, CASADI, MANIFEST}


def test_the_manifest_describes_the_files_and_its_hashes_tell_what_changed(made, tmp_path):
    expected = texts(made)
    manifest = json.loads(expected[MANIFEST])
    content, abi = manifest["content_hash"], manifest["abi_hash"]
    assert manifest["files"].keys() == FILES - {MANIFEST}
    assert all(content in expected[name] for name in (HEADER, CASADI))
    changes = [{"parameters": {"gravity": 1.62}}, {"real": "float"}, {"functions": ["energy"]}]
    contents, abis = [content], [abi]
    for change in (*changes, {"emission": "straight"}):
        made_in(tmp_path, **change)
        now = json.loads((tmp_path / NAME / MANIFEST).read_text())
        contents.append(now["content_hash"])
        abis.append(now["abi_hash"])
    assert len({*contents}) == 5 and abis[1] == abi and len({*abis}) == 4


def test_bytes_are_compared_and_a_damaged_manifest_harms_nothing(tmp_path):
    write_folder(tmp_path / "folder", {"a.txt": "\u00e4\n"}, {})
    assert (tmp_path / "folder/a.txt").read_bytes() == "\u00e4\n".encode()
    (tmp_path / "folder/a.txt").write_bytes("\u00e4\r\n".encode())
    assert write_folder(tmp_path / "folder", {"a.txt": "\u00e4\n"}, {}) == ["a.txt"]
    (tmp_path / "outside.txt").write_text("outside")
    away = '{"files": {"../outside.txt": "", "/outside.txt": "", "lost": ""}}'
    for k, manifest in enumerate(["", "{", "[]", "{}", '{"files": 3}', "null", away]):
        with row(manifest):
            folder = tmp_path / str(k)
            folder.mkdir()
            (folder / "manifest.json").write_text(manifest)
            write_folder(folder, {"a.txt": "a"}, {})
            assert set(texts(folder)) == {"a.txt", "manifest.json"}
            assert (tmp_path / "outside.txt").read_text() == "outside"

"""Generated folders: what does not fit together is refused with its name and the way out; the cache
serves many.
"""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.targets.write import signed
from tests.support.models import model_folder

UPRIGHT = [0, 0, 0, 1, 0, 0, 0, 0, 0]
AGAIN = "generate it again (`make model`, or python -m serpentail_codegen SCENE.toml)"


@pytest.fixture
def folder(tmp_path):
    """A copy of the smallest model, to break."""
    return shutil.copytree(
        model_folder(1, 1, name="tail", functions=["mass_matrix"]), tmp_path / "tail"
    )


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache and no $CC."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def script(tmp_path, monkeypatch):
    """Make $CC a shell script that does `body` and then what cc does."""
    real = shutil.which("cc") or shutil.which("gcc")

    def install(body):
        path = tmp_path / "mycc"
        path.write_text(f'#!/bin/sh\n{body}\nexec {real} "$@"\n')
        path.chmod(0o755)
        monkeypatch.setenv("CC", str(path))

    return install


def edit(folder, change=lambda manifest: manifest, **changes):
    """Change entries of the manifest, then the whole; None removes an entry."""
    path = folder / "manifest.json"
    manifest = {k: v for k, v in (json.loads(path.read_text()) | changes).items() if v is not None}
    path.write_text(json.dumps(change(manifest)))


def refusal(folder):
    """The message that refuses a folder."""
    with pytest.raises(st.ModelError) as caught:
        st.load(folder)
    return str(caught.value)


def test_intact_copy_loads(folder):
    assert st.load(folder).name == st.load(str(folder)).name == "tail"


# What does not fit


@pytest.mark.parametrize("place", ["nowhere", "tail/src", "tail/manifest.json"])
def test_folder_without_manifest_says_how_to_make_one(folder, tmp_path, place):
    message = refusal(tmp_path / place)
    assert message.startswith(
        f"{tmp_path / place} is not a generated folder (it has no manifest.json)"
    )
    assert "make model TAIL=articulated M=3 N=4" in message


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", '{"format": 2}', "\xff"])
def test_damaged_manifest(folder, text):
    (folder / "manifest.json").write_text(text, encoding="latin-1")
    message = refusal(folder)
    assert message.startswith(f"{folder / 'manifest.json'} is damaged (") and message.endswith(
        AGAIN
    )


def test_half_a_manifest(folder):
    path = folder / "manifest.json"
    path.write_bytes(path.read_bytes()[:-100])
    assert "is damaged (" in refusal(folder)


@pytest.mark.parametrize(
    "key",
    [
        "format",
        "generator",
        "abi_hash",
        "prefix",
        "real",
        "dimensions",
        "parameters",
        "functions",
        "work",
        "files",
        "manifest_hash",
    ],
)
def test_manifest_without_an_entry(folder, key):
    edit(folder, **{key: None})
    assert "manifest.json is damaged (" in refusal(folder) and key in refusal(folder)


@pytest.mark.parametrize(
    "change", [{"generator": "0.0.9"}, {"format": 1}, {"generator": "0.0.9", "parameters": None}]
)
def test_folder_of_another_generator_is_stale(folder, change):
    edit(folder, **change)
    message = refusal(folder)
    assert f"{folder} is stale: made by format {change.get('format', 2)}, " in message
    assert f"this is format 2, {st.__version__}" in message.replace(
        "generator ", ""
    ) and message.endswith(AGAIN)


@pytest.mark.parametrize(
    "name", ["src/tail.c", "src/tail_host.c", "include/tail.h", "tail_casadi.py"]
)
def test_changed_file_is_named(folder, name):
    (folder / name).write_text((folder / name).read_text() + " ")
    assert (
        refusal(folder)
        == f"{folder / name} was changed after it was generated: delete {folder} and {AGAIN}"
    )


@pytest.mark.parametrize("name", ["src/tail.c", "include/tail.h", "tail_casadi.py"])
def test_missing_file_is_named(folder, name):
    (folder / name).unlink()
    expected = (
        f"{folder / name} cannot be read (No such file or directory): delete {folder} and {AGAIN}"
    )
    assert refusal(folder) == expected


def larger(manifest):
    """The tail of a segment more: what C then reads lies beyond the arrays it is given."""
    sizes = manifest["dimensions"]
    return manifest | {
        "dimensions": sizes | {"segments": 2, "nq": sizes["nq"] + 2, "nv": sizes["nv"] + 2}
    }


def heavier(manifest):
    """Another default of a parameter."""
    manifest["parameters"][1]["default"] *= 2
    return manifest


@pytest.mark.parametrize(
    "change", [larger, heavier, lambda manifest: manifest | {"work": {"mass_matrix": 0, "x": 1}}]
)
def test_manifest_changed_by_hand_is_named(folder, change):
    edit(folder, change)
    message = refusal(folder)
    assert message.startswith(
        f"{folder / 'manifest.json'} was changed after it was generated: delete {folder}"
    )
    assert "st.load(folder, parameters=...)" in message


def test_manifest_laid_out_anew_is_the_same(folder):
    edit(folder, lambda manifest: dict(sorted(manifest.items())))
    assert st.load(folder).name == "tail"


def test_manifest_of_other_code(folder):
    edit(folder, signed, abi_hash="0123456789abcdef")
    message = refusal(folder)
    assert "the manifest 0123456789abcdef" in message and message.endswith(
        f"delete {folder} and {AGAIN}"
    )


# Compilers


@pytest.mark.parametrize("chosen", ["no-such-cc", "false"])
def test_broken_cc_is_named(folder, cache, monkeypatch, chosen):
    monkeypatch.setenv("CC", chosen)
    with pytest.raises(
        st.CompilerNotFound, match=f"CC='{chosen}' does not work as a C compiler.*set CC to"
    ):
        st.load(folder)


def test_no_compiler_says_how_to_get_one(folder, cache, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(
        st.CompilerNotFound, match=r"no C compiler works here.*apt install gcc.*pip install ziglang"
    ):
        st.load(folder)


def test_compilers_message_is_shown(folder, cache, script):
    script('case "$*" in *-shared*) echo "tail.c:7: out of patience" >&2; exit 3;; esac')
    with pytest.raises(
        st.CompileFailed, match=r"exit code 3\ntail\.c:7: out of patience\nCommand: "
    ) as caught:
        st.load(folder)
    assert caught.value.returncode == 3 and isinstance(caught.value, st.SerpentailError)
    assert not list(cache.rglob("*.so")) and not list(cache.rglob("*.part"))


def test_library_that_cannot_be_loaded(folder, cache, monkeypatch):
    foreign = folder / "foreign.so"
    foreign.write_text("of another machine")
    monkeypatch.setattr("serpentail.model.library.model_library", lambda *_: foreign)
    with pytest.raises(
        st.SerpentailError, match=r"cannot be loaded \(.*foreign\.so.*set SERPENTAIL_CACHE"
    ):
        st.load(folder)


# The cache


def test_four_processes_load_one_model_without_locks(folder, cache, script, tmp_path, monkeypatch):
    """All meet before the compiler starts, compile at once, and end with one library that is
    whole.
    """
    monkeypatch.setattr("serpentail.model.calls.extension", lambda: None)
    cache.mkdir()
    (cache / "locks").touch()  # where the folder of the locks should be
    meet = (
        f'case "$*" in *-shared*) touch {tmp_path}/$$.here; '
        f"for n in 1 2 3 4 5 6 7 8 9; do "
        f"[ $(ls {tmp_path} | grep -c here) -ge 4 ] && break; sleep 1; done;; esac"
    )
    script(meet)
    program = (
        "import sys, serpentail as st; from serpentail.model import calls; "
        "calls.extension = lambda: None; "  # the model's library alone
        f"print(st.load(sys.argv[1]).mass_matrix({UPRIGHT}).tobytes().hex())"
    )
    command = [sys.executable, "-c", program, str(folder)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    crowd = [subprocess.Popen(command, env=os.environ, **pipes) for _ in range(4)]
    answers = [process.communicate() for process in crowd]
    assert len(list(tmp_path.glob("*.here"))) == 4
    expected = st.load(folder).mass_matrix(UPRIGHT).tobytes().hex()
    assert answers == [(f"{expected}\n", "")] * 4
    assert len(list(cache.rglob("*.so"))) == 1 and not list(cache.rglob("*.part"))


def test_second_load_compiles_nothing(folder, cache, monkeypatch):
    found = st.load(folder).mass_matrix(UPRIGHT)  # the first call compiles what calls C, too
    monkeypatch.setattr("serpentail.model.compiler._compile", None)
    np.testing.assert_array_equal(st.load(folder).mass_matrix(UPRIGHT), found)

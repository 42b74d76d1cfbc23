"""One text gives one library for a compiler and a machine, in a cache of bounded size."""

import hashlib
import json
import os
import shutil
import time

import pytest

import serpentail as st
from serpentail.cli import cli
from serpentail.compiling import cache_limit as bound
from serpentail.compiling import compiler
from serpentail.compiling.cache import publish
from tests.support.file_faults import HOUR, age

from ..support.rows import row
from .conftest import TWICE, call_twice, forbid_processes, libraries


def test_a_library_works_and_is_found_again_without_a_process(model, cache, tmp_path, monkeypatch):
    umask = os.umask(0)
    try:
        built = {p: compiler.compile_library(*model, profile=p) for p in ("fast", "reproducible")}
    finally:
        os.umask(umask)
    assert cache.stat().st_mode & 0o777 == 0o700
    open_to_others = [path for path in cache.rglob("*") if path.stat().st_mode & 0o022]
    assert all("locks" in path.parts and path.is_file() for path in open_to_others)
    assert [call_twice(library) for library in built.values()] == [42.0, 42.0]
    assert sorted(libraries(cache)) == sorted(built.values())
    moved = shutil.copytree(tmp_path / "model", tmp_path / "elsewhere")
    forbid_processes(monkeypatch)
    for profile, library in built.items():
        for place in (model, ([moved / "src" / "twice.c"], moved / "include")):
            assert compiler.compile_library(*place, profile=profile) == library


def test_all_that_matters_reaches_the_key_and_nothing_else(model, cache, monkeypatch):
    (source,), include = model
    renamed = source.with_name("renamed.c")
    built = [compiler.compile_library(*model, profile=p) for p in ("fast", "reproducible")]
    for change in (
        lambda: (source.parent / "private.h").write_text("#define PRIVATE 1\n"),
        lambda: (include / "scale.h").write_text("#define SCALE 3.0\n"),
        lambda: source.write_text(TWICE.replace("* x", "* x + 1.0")),
    ):
        change()
        built.append(compiler.compile_library(*model))
    source.rename(renamed)
    for flags in ((), ("-DMORE",)):
        built.append(compiler.compile_library([renamed], include, flags=flags))
    assert len({library.parent for library in built}) == len(built)
    assert [call_twice(library) for library in built] == [42.0] * 3 + [63.0] + [64.0] * 3
    # of the environment, also the key of what is known about the compiler
    matter = ("MACOSX_DEPLOYMENT_TARGET", "LD_LIBRARY_PATH", "CCACHE_DIR", "NIX_CFLAGS")
    for name in (*matter, "CPATH", "LIBRARY_PATH", "TMPDIR", "LANG"):
        with monkeypatch.context() as changed, row(name):
            changed.setenv(name, "/tmp")
            found = compiler.compile_library([renamed], include)
            assert (found.parent != built[-2].parent) == (name in matter)
    assert len(list((cache / "compilers").iterdir())) == 2 + len(matter)  # of two profiles
    # arguments of CC reach the compiler, too
    renamed.write_text(TWICE.replace("SCALE", "(SCALE + MORE)"))
    for more in (1.0, 2.0):
        monkeypatch.setenv("CC", f"cc -DMORE={more}")
        assert call_twice(compiler.compile_library([renamed], include)) == 21 * (3 + more)


def test_c_library_processor_and_version_reach_the_key(model, monkeypatch, script, tmp_path):
    told = {"version": "mycc 1", "target": "-march= zen"}
    asks = [f"*{word}*) cat {tmp_path}/{word}; exit 0;;" for word in told]
    script(f'case "$*" in {" ".join(asks)} esac')
    asked, places = [], []

    def build(**changes):
        for word, text in (told | changes).items():
            (tmp_path / word).write_text(text)
        places.append(compiler.compile_library(*model).parent)

    build()
    monkeypatch.setattr(os, "confstr", lambda name: asked.append(name) or "glibc 2.99")
    build()
    monkeypatch.setattr("serpentail.compiling.toolchain.processor", lambda: "lake")
    build(target="-march= lake")
    shutil.rmtree(places[2])  # or the note of the old version would do
    build(target="-march= lake", version="mycc 2")
    assert len({*places}) == 4 and {*asked} == {"CS_GNU_LIBC_VERSION"}
    assert compiler.describe_compiler()["version"] == "mycc 2"
    forbid_processes(monkeypatch)
    assert compiler.compile_library(*model).parent == places[3]


SCRUBBED = {"CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "COMPILER_PATH", "GCC_EXEC_PREFIX"}
SCRUBBED |= {"SOURCE_DATE_EPOCH", "CCC_OVERRIDE_OPTIONS", "LD_RUN_PATH", "LANG", "LC_MESSAGES"}


def test_compilers_are_asked_for_flags_and_get_little_of_the_environment(
    model, script, monkeypatch, tmp_path
):
    for name in {*SCRUBBED, "CCACHE_DIR"}:
        monkeypatch.setenv(name, "/nowhere")
    refusal = 'case "$*" in *{}*) echo "unknown argument" >&2; exit 1;; esac'
    script(refusal.format("-march=native"))
    assert "-march=native" not in compiler.describe_compiler()["flags"]
    script(f"{refusal.format('=native')}; env >> {tmp_path}/environment")
    flags = compiler.describe_compiler()["flags"]
    assert not [flag for flag in flags if flag.endswith("=native")]
    assert call_twice(compiler.compile_library(*model)) == 42.0
    names = {line.split("=")[0] for line in (tmp_path / "environment").read_text().splitlines()}
    assert not names & SCRUBBED and {"PATH", "CCACHE_DIR", "LC_ALL"} <= names
    monkeypatch.setenv("CC", f"{shutil.which('cc')} -pipe")
    fast, exact = map(compiler.describe_compiler, ("fast", "reproducible"))
    assert fast["command"] == "cc -pipe" and fast["version"]
    assert "-ffp-contract=fast" in fast["flags"] and "-ffp-contract=off" in exact["flags"]
    assert not [flag for flag in exact["flags"] if "native" in flag]


NO_NOTES = ("", "{", "[]", "{}", "[" * 100_000)
OTHERS = {  # what may be in the place of a file
    "less": lambda path: path.write_bytes(b"\x7fELF"),
    "no text": lambda path: path.write_bytes(b"\xff\xfe\x00"),
    "pipe": os.mkfifo,
    "folder": lambda path: (path / "more").mkdir(parents=True),
    "dangling": lambda path: path.symlink_to("nowhere"),
}


def test_damaged_notes_and_libraries_are_made_again(model, cache, tmp_path):
    library = compiler.compile_library(*model)
    (note,) = (cache / "compilers").glob("*/*")
    sound = json.loads(note.read_text())
    texts = [*NO_NOTES, *(json.dumps(sound | {key: 3}) for key in sound)]
    puts = [lambda path, text=text: path.write_text(text) for text in texts]
    for path in (note, library):
        whole = path.read_bytes()
        for k, put in enumerate((*OTHERS.values(), *puts)):
            with row(path, k):
                path.unlink()
                put(path)
                assert compiler.compile_library(*model) == library
                assert path.read_bytes() == whole and libraries(cache) == [library]
    for make in (os.mkfifo, os.mknod):  # in place of its folder
        with row(make):
            shutil.rmtree(library.parent)
            make(library.parent)
            assert compiler.compile_library(*model).read_bytes() == whole
    place, part = library.parent, tmp_path / "part"  # what another process made meanwhile stays
    part.mkdir()
    publish(part, place, lambda: True)
    assert place.exists() and part.exists()


def test_a_library_that_cannot_be_loaded_is_made_anew_and_told_in_a_line(model, cache, caplog):
    library, damaged = compiler.compile_library(*model), b"no library"
    library.unlink()
    (library.parent / f"{hashlib.sha256(damaged).hexdigest()}.so").write_bytes(damaged)
    opened = compiler.opened(lambda: compiler.compile_library(*model))
    assert call_twice(opened._name) == 42 and libraries(cache) == [library]
    (record,) = caplog.records
    assert f"{library.parent} was damaged" in record.getMessage()


def built(model, number):
    (source,), include = model
    source.write_text(f"{TWICE}int number = {number};\n")
    return compiler.compile_library([source], include)


def used(path, hours):
    os.utime(path, (time.time() - hours * HOUR,) * 2)


def test_what_was_not_used_for_longest_goes_and_what_is_in_use_stays(model, cache, monkeypatch):
    entries, parts = [built(model, number).parent for number in range(4)], cache / "parts"
    for hours, entry in zip((20, 9, 2, 5), entries, strict=True):
        used(entry, hours)
    built(model, 0)  # used now
    size = sum(path.stat().st_size for path in entries[0].iterdir())
    monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", str(int(4.5 * size)))
    for name in ("0" * 24, "mine"):
        (parts / name / "more").mkdir(parents=True)
    age(parts)
    (parts / ("1" * 24)).mkdir()
    last = built(model, 4).parent
    assert [entry.exists() for entry in (*entries, last)] == [True, False, True, True, True]
    assert {path.name for path in parts.iterdir()} == {"1" * 24, "mine"}
    monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", "1")
    libraries = [built(model, number) for number in range(5, 8)]
    assert [call_twice(library) for library in libraries] == [42.0] * 3
    for library in libraries:
        used(library.parent, 1)
    assert built(model, 8).exists() and not any(library.exists() for library in libraries)
    for text, size in {"": 2**30, "17": 17, "500M": 500 * 2**20, "2g": 2**31}.items():
        monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", text)
        assert bound.limit() == size, text
    for text in ("much", "-1", "1.5G", "1 G B", "\u0663"):
        monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", text)
        with row(text), pytest.raises(st.SerpentailError, match=r"SERPENTAIL_CACHE_SIZE: value"):
            built(model, 9)


def test_command_tells_and_empties(model, cache, capsys):
    libraries = [built(model, number) for number in range(2)]
    assert call_twice(libraries[0]) == 42.0  # it is in use
    least = sum(library.stat().st_size for library in libraries)
    (cache / "mine.txt").touch()
    (cache / "libraries" / "mine").mkdir()
    counts, told = {"libraries": 2, "models": 0, "builds": 0, "compilers": 1, "solvers": 0}, []
    for words in ([], ["--clean"]):
        assert cli.main(["cache", *words, "--json", "-"]) == 0
        told.append(json.loads(capsys.readouterr().out))
    assert told[0].pop("bytes") > least
    assert told[0] == {"folder": str(cache), **counts, "limit": 2**30}
    assert told[1] == told[0] | dict.fromkeys([*counts, "bytes"], 0)
    left = {path.relative_to(cache).as_posix() for path in cache.rglob("*")}
    folders = {"libraries", "compilers", "locks", "parts"}
    assert left == {*folders, "mine.txt", "libraries/mine"}

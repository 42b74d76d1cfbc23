"""One text gives one library for a compiler and a machine, and all that matters is in its key.

What is in the cache is run: others may not say how it is compiled, and what is damaged is made
anew.  The cache has a size, by which what nobody uses goes; a command tells what is in it.
"""

import json
import os
import shutil
import time

import pytest

import serpentail as st
from serpentail import cli
from serpentail.model import bound, compiler
from serpentail.model.cache import publish
from tests.support.file_faults import HOUR, age

from ...support.rows import row
from .conftest import TWICE, call_twice, forbid_processes, libraries


def test_a_library_works_and_is_found_again_without_a_process(model, cache, monkeypatch):
    """For the user alone."""
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
    forbid_processes(monkeypatch)
    for profile, library in built.items():
        assert compiler.compile_library(*model, profile=profile) == library


def test_text_compiles_once_wherever_it_lies(model, tmp_path, script):
    calls = script()
    first = compiler.compile_library(*model)
    moved = shutil.copytree(tmp_path / "model", tmp_path / "elsewhere")
    assert compiler.compile_library([moved / "src/twice.c"], moved / "include") == first
    assert calls.read_text().count("twice.c") == 1


def test_every_input_reaches_the_key(model):
    (source,), include = model
    built = [compiler.compile_library(*model, profile=p) for p in ("fast", "reproducible")]
    (source.parent / "private.h").write_text("#define PRIVATE 1\n")
    built.append(compiler.compile_library(*model))
    (include / "scale.h").write_text("#define SCALE 3.0\n")
    built.append(compiler.compile_library(*model))
    source.write_text(TWICE.replace("* x", "* x + 1.0"))
    built.append(compiler.compile_library(*model))
    renamed = source.rename(source.with_name("renamed.c"))
    built.append(compiler.compile_library([renamed], include))
    built.append(compiler.compile_library([renamed], include, flags=("-DMORE",)))
    assert len({library.parent for library in built}) == len(built)
    assert [call_twice(library) for library in built] == [42.0] * 3 + [63.0] + [64.0] * 3


def test_surroundings_that_matter_reach_the_key_and_no_others(model, cache, monkeypatch):
    """Those that matter reach the key of what is known about the compiler, too."""
    first, known = compiler.compile_library(*model), 1
    for name in ("MACOSX_DEPLOYMENT_TARGET", "LD_LIBRARY_PATH", "CCACHE_DIR", "NIX_CFLAGS"):
        with monkeypatch.context() as changed, row(name):
            changed.setenv(name, "/elsewhere")
            assert compiler.compile_library(*model).parent != first.parent
            known += 1
            assert len(list((cache / "compilers").iterdir())) == known
    for name in ("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "TMPDIR", "LANG"):
        with monkeypatch.context() as changed, row(name):
            changed.setenv(name, "/tmp")
            assert compiler.compile_library(*model) == first
    (source,), _ = model  # arguments of CC reach the compiler, too
    source.write_text(TWICE.replace("SCALE", "(SCALE + MORE)"))
    for more in (1.0, 2.0):
        monkeypatch.setenv("CC", f"cc -DMORE={more}")
        assert call_twice(compiler.compile_library(*model)) == 21 * (2 + more)


def test_c_library_reaches_the_key(model, monkeypatch):
    first, asked = compiler.compile_library(*model), []
    for version in ("glibc 2.17", "glibc 2.99"):
        monkeypatch.setattr(os, "confstr", lambda name, v=version: asked.append(name) or v)
        another = compiler.compile_library(*model)
        assert another.parent != first.parent
        first = another
    assert set(asked) == {"CS_GNU_LIBC_VERSION"}


def test_another_processor_gets_another_library(model, monkeypatch, script, tmp_path):
    script(f'case "$*" in *help=target*) cat {tmp_path}/processor; exit 0;; esac')
    built = []
    for processor in ("zen", "lake"):
        (tmp_path / "processor").write_text(f"-march= {processor}\n")
        monkeypatch.setattr("serpentail.model.toolchain._processor", lambda p=processor: p)
        built.append(compiler.compile_library(*model))
    assert built[0].parent != built[1].parent
    forbid_processes(monkeypatch)
    assert compiler.compile_library(*model) == built[1]


def test_upgrade_behind_a_wrapper_reaches_the_next_key(model, script, tmp_path):
    script(f'case "$*" in *--version*) cat {tmp_path}/version; exit 0;; esac')
    (tmp_path / "version").write_text("mycc 1\n")
    old = compiler.compile_library(*model)
    (tmp_path / "version").write_text("mycc 2\n")
    shutil.rmtree(old.parent)
    new = compiler.compile_library(*model)
    assert new.parent != old.parent
    assert compiler.describe_compiler()["version"] == "mycc 2"


def test_native_flag_falls_back_and_flags_are_told(model, script, monkeypatch):
    refusal = 'case "$*" in *{}*) echo "unknown argument" >&2; exit 1;; esac'
    script(refusal.format("-march=native"))
    assert "-march=native" not in compiler.describe_compiler()["flags"]
    script(refusal.format("=native"))
    flags = compiler.describe_compiler()["flags"]
    assert not [flag for flag in flags if flag.endswith("=native")]
    assert call_twice(compiler.compile_library(*model)) == 42.0
    monkeypatch.setenv("CC", f"{shutil.which('cc')} -pipe")
    fast, exact = map(compiler.describe_compiler, ("fast", "reproducible"))
    assert fast["command"] == "cc -pipe" and fast["version"]
    assert "-ffp-contract=fast" in fast["flags"] and "-ffp-contract=off" in exact["flags"]
    assert not [flag for flag in exact["flags"] if "native" in flag]
    assert "-ffast-math" not in fast["flags"] + exact["flags"]


SCRUBBED = {"CPATH", "C_INCLUDE_PATH", "CPLUS_INCLUDE_PATH", "OBJC_INCLUDE_PATH", "LIBRARY_PATH"}
SCRUBBED |= {"COMPILER_PATH", "GCC_EXEC_PREFIX", "DEPENDENCIES_OUTPUT", "SUNPRO_DEPENDENCIES"}
SCRUBBED |= {"SOURCE_DATE_EPOCH", "CCC_OVERRIDE_OPTIONS", "LD_RUN_PATH", "LANG", "LC_MESSAGES"}


def test_compilers_get_little_of_the_environment(model, monkeypatch, script, tmp_path):
    for name in SCRUBBED:
        monkeypatch.setenv(name, "/nowhere")
    monkeypatch.setenv("CCACHE_DIR", "/somewhere")
    script(f"env >> {tmp_path}/environment")
    compiler.compile_library(*model)
    names = {line.split("=")[0] for line in (tmp_path / "environment").read_text().splitlines()}
    assert not names & SCRUBBED and {"PATH", "CCACHE_DIR", "LC_ALL"} <= names


WRONG_NOTES = [
    *("", "{", "[]", "{}", "[" * 100_000, '"\\ud800"'),
    '{"works": true, "flags": 3, "version": "x", "target": "y"}',
    '{"works": true, "flags": [1], "version": "x", "target": "y"}',
    '{"works": true, "flags": ["-O2"], "version": null, "target": "y"}',
    '{"works": true, "flags": ["-O2"], "version": "x", "target": {}}',
    '{"works": "yes", "flags": [], "version": "x", "target": "y"}',
]

OTHERS = {  # what may be in a file's place
    "less": lambda path: path.write_bytes(b"\x7fELF"),
    "no text": lambda path: path.write_bytes(b"\xff\xfe\x00"),
    "pipe": os.mkfifo,
    "folder": lambda path: (path / "more").mkdir(parents=True),
    "dangling": lambda path: path.symlink_to("nowhere"),
}


def test_damaged_note_is_written_again(model, cache):
    library = compiler.compile_library(*model)
    (note,) = (cache / "compilers").iterdir()
    whole = note.read_text()
    puts = [lambda path, text=text: path.write_text(text) for text in WRONG_NOTES]
    for k, put in enumerate((*OTHERS.values(), *puts)):
        with row(k):
            note.unlink()
            put(note)
            assert compiler.compile_library(*model) == library
            assert note.read_text() == whole


def test_damaged_library_is_compiled_again(model, cache):
    library = compiler.compile_library(*model)
    whole = library.read_bytes()
    for name, put in OTHERS.items():
        with row(name):
            library.unlink()
            put(library)
            assert compiler.compile_library(*model).read_bytes() == whole
            assert libraries(cache) == [library]
    assert call_twice(library) == 42.0
    for make in (os.mkfifo, os.mknod):  # in place of its folder
        with row(make):
            shutil.rmtree(library.parent)
            make(library.parent)
            assert compiler.compile_library(*model).read_bytes() == whole


def test_entry_of_another_process_stays(tmp_path):
    place, part = tmp_path / "kind" / "entry", tmp_path / "part"
    for path in (place, part):
        path.mkdir(parents=True)
        (path / "file").write_text(path.name)
    publish(part, place, lambda place: (place / "file").read_text() == "entry")
    assert (place / "file").read_text() == "entry" and part.exists()


# The size of the cache


def built(model, number):
    (source,), include = model
    source.write_text(f"{TWICE}int number = {number};\n")
    return compiler.compile_library([source], include)


def used(path, hours):
    """Let an entry have been used last so long ago."""
    os.utime(path, (time.time() - hours * HOUR,) * 2)


def test_what_was_not_used_for_longest_goes_and_what_is_in_use_stays(model, cache, monkeypatch):
    entries = [built(model, number).parent for number in range(4)]
    for hours, entry in zip((20, 9, 2, 5), entries, strict=True):
        used(entry, hours)
    built(model, 0)  # used now
    size = sum(path.stat().st_size for path in entries[0].iterdir())
    monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", str(int(4.5 * size)))
    last = built(model, 4).parent
    assert [entry.exists() for entry in entries] == [True, False, True, True] and last.exists()
    assert not list((cache / "parts").iterdir())
    monkeypatch.setenv("SERPENTAIL_CACHE_SIZE", "1")  # what is in use stays
    libraries = [built(model, number) for number in range(5, 8)]
    assert [call_twice(library) for library in libraries] == [42.0] * 3
    for library in libraries:
        used(library.parent, 1)
    assert built(model, 8).exists() and not any(library.exists() for library in libraries)


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


def test_command_tells_and_empties(model, cache, capsys):
    libraries = [built(model, number) for number in range(2)]
    assert call_twice(libraries[0]) == 42.0  # it is in use
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

"""What is in the cache is run: others may not have put it there, nor say how it is compiled; what
is damaged is made anew.
"""

import os
import shutil

import pytest

import serpentail as st
from serpentail.model import compiler
from serpentail.model.cache import publish

from ...support.rows import row
from .conftest import call_twice, libraries

OTHER = 12345  # user id of somebody else
as_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files to others")


def refusal(model):
    with pytest.raises(st.SerpentailError) as caught:
        compiler.compile_library(*model)
    return str(caught.value)


# Whose it is


def test_what_is_made_is_for_the_user_alone(model, cache):
    before = os.umask(0)
    try:
        compiler.compile_library(*model)
    finally:
        os.umask(before)
    modes = {path: path.stat().st_mode & 0o022 for path in (cache, *cache.rglob("*"))}
    assert not any(modes[path] for path in modes if "locks" not in path.parts or path.is_dir())
    assert cache.stat().st_mode & 0o777 == 0o700


def test_cache_that_others_may_write_is_refused(model, cache):
    library = compiler.compile_library(*model)
    for path in (cache, library.parents[1], library.parent, library):
        for mode in (0o777, 0o775, 0o770, 0o757):
            with row(path, oct(mode)):
                path.chmod(mode)
                message = refusal(model)
                assert str(path) in message and "is writable by others" in message
                assert f"`chmod -R go-w {path}`" in message and "SERPENTAIL_CACHE" in message
                path.chmod(0o700)
    assert compiler.compile_library(*model) == library


def test_cache_in_a_folder_for_all_is_no_folder_for_all(model, cache, monkeypatch):
    """A cache below /tmp serves; /tmp itself does not, and nobody is told to close it."""
    cache.mkdir()
    cache.chmod(0o1777)
    message = refusal(model)
    assert "is writable by others" in message and "chmod" not in message
    monkeypatch.setenv("SERPENTAIL_CACHE", str(cache / "mine"))
    assert call_twice(compiler.compile_library(*model)) == 42.0


@as_root
def test_what_belongs_to_somebody_else_is_refused(model, cache):
    library = compiler.compile_library(*model)
    (note,) = (cache / "compilers").iterdir()
    for path in (cache, library.parents[1], library.parent, library, note.parent, note):
        with row(path):
            os.chown(path, OTHER, OTHER)
            message = refusal(model)
            assert f"{path} belongs to user {OTHER}" in message and "SERPENTAIL_CACHE" in message
            os.chown(path, 0, 0)
    assert compiler.compile_library(*model) == library


# What the compiler is told

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


# What is damaged is made anew

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
    damages = OTHERS | {
        text[:60]: lambda path, text=text: path.write_text(text) for text in WRONG_NOTES
    }
    for name, put in damages.items():
        with row(name):
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
    """Who comes second throws his own away."""
    place, part = tmp_path / "kind" / "entry", tmp_path / "part"
    for path in (place, part):
        path.mkdir(parents=True)
        (path / "file").write_text(path.name)
    publish(part, place, lambda place: (place / "file").read_text() == "entry")
    assert (place / "file").read_text() == "entry" and part.exists()

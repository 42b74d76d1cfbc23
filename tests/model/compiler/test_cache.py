"""One text gives one library for a compiler and a machine, and all that matters is in its key."""

import os
import shutil

from serpentail.model import compiler

from ...support.rows import row
from .conftest import TWICE, call_twice, forbid_processes, libraries


def test_a_library_works_and_is_found_again_without_a_process(model, cache, monkeypatch):
    built = {p: compiler.compile_library(*model, profile=p) for p in ("fast", "reproducible")}
    assert [call_twice(library) for library in built.values()] == [42.0, 42.0]
    assert sorted(libraries(cache)) == sorted(built.values())
    forbid_processes(monkeypatch)
    for profile, library in built.items():
        assert compiler.compile_library(*model, profile=profile) == library


def test_text_compiles_once_wherever_it_lies(model, tmp_path, script):
    calls = script()
    first = compiler.compile_library(*model)
    moved = tmp_path / "elsewhere"
    shutil.copytree(tmp_path / "model", moved)
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


def test_arguments_of_cc_reach_the_key_and_the_compiler(model, monkeypatch):
    (source,), include = model
    source.write_text('#include "scale.h"\ndouble twice(double x) { return (SCALE + MORE) * x; }\n')
    built = []
    for more in ("1.0", "2.0"):
        monkeypatch.setenv("CC", f"cc -DMORE={more}")
        built.append(call_twice(compiler.compile_library([source], include)))
    assert built == [63.0, 84.0]


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


def test_native_flag_falls_back(model, script):
    refusal = 'case "$*" in *{}*) echo "unknown argument" >&2; exit 1;; esac'
    script(refusal.format("-march=native"))
    assert "-march=native" not in compiler.describe_compiler()["flags"]
    script(refusal.format("=native"))
    flags = compiler.describe_compiler()["flags"]
    assert not [flag for flag in flags if flag.endswith("=native")]
    assert call_twice(compiler.compile_library(*model)) == 42.0


def test_description_tells_flags_and_no_folder(monkeypatch):
    monkeypatch.setenv("CC", f"{shutil.which('cc')} -pipe")
    fast, exact = map(compiler.describe_compiler, ("fast", "reproducible"))
    assert fast["command"] == "cc -pipe" and fast["version"]
    assert "-ffp-contract=fast" in fast["flags"] and "-ffp-contract=off" in exact["flags"]
    assert not [flag for flag in exact["flags"] if "native" in flag]
    assert "-ffast-math" not in fast["flags"] + exact["flags"]

"""The compiler cache: one text gives one working library, and whatever goes wrong is named."""

from __future__ import annotations

import shutil
import time

import pytest

from serpentail.model import compiler

from .sources import TWICE, call_twice, forbid_processes, libraries


@pytest.mark.parametrize("profile", ["fast", "reproducible"])
def test_library_works(model, profile, cache):
    library = compiler.compile_library(*model, profile=profile)
    assert call_twice(library) == 42.0
    assert libraries(cache) == [library]


def test_second_call_starts_no_process(model, monkeypatch):
    first = compiler.compile_library(*model)
    forbid_processes(monkeypatch)
    started = time.perf_counter()
    assert compiler.compile_library(*model) == first
    assert time.perf_counter() - started < 0.1


def test_text_compiles_once_wherever_it_lies(model, tmp_path, script):
    calls = script()
    first = compiler.compile_library(*model)
    moved = tmp_path / "elsewhere"
    shutil.copytree(tmp_path / "model", moved)
    assert compiler.compile_library([moved / "src/twice.c"], moved / "include") == first
    assert calls.read_text().count("twice.c") == 1


def test_every_input_reaches_the_key(model, tmp_path):
    (source,), include = model
    built = [
        compiler.compile_library(*model, profile=profile) for profile in ("fast", "reproducible")
    ]
    (source.parent / "private.h").write_text("#define PRIVATE 1\n")
    built.append(compiler.compile_library(*model))
    (include / "scale.h").write_text("#define SCALE 3.0\n")
    built.append(compiler.compile_library(*model))
    source.write_text(TWICE.replace("* x", "* x + 1.0"))
    built.append(compiler.compile_library(*model))
    renamed = source.rename(source.with_name("renamed.c"))
    built.append(compiler.compile_library([renamed], include))
    assert len({library.parent for library in built}) == len(built)
    assert [call_twice(library) for library in built] == [42.0, 42.0, 42.0, 63.0, 64.0, 64.0]


def test_arguments_of_cc_reach_the_key_and_the_compiler(model, monkeypatch):
    (source,), include = model
    source.write_text('#include "scale.h"\ndouble twice(double x) { return (SCALE + MORE) * x; }\n')
    built = []
    for more in ("1.0", "2.0"):
        monkeypatch.setenv("CC", f"cc -DMORE={more}")
        built.append(call_twice(compiler.compile_library([source], include)))
    assert built == [63.0, 84.0]


def test_another_processor_gets_another_library(model, monkeypatch, script, tmp_path):
    script(f'case "$*" in *help=target*) cat {tmp_path}/processor; exit 0;; esac')
    built = []
    for processor in ("zen", "lake"):
        (tmp_path / "processor").write_text(f"-march= {processor}\n")
        monkeypatch.setattr(
            "serpentail.model.toolchain._processor", lambda processor=processor: processor
        )
        built.append(compiler.compile_library(*model))
    assert built[0].parent != built[1].parent
    forbid_processes(monkeypatch)
    assert compiler.compile_library(*model) == built[1]


def test_upgrade_behind_a_wrapper_reaches_the_next_key(model, monkeypatch, script, tmp_path):
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


def test_profiles_differ_in_contraction():
    fast, exact = (
        compiler.describe_compiler(profile)["flags"] for profile in ("fast", "reproducible")
    )
    assert "-ffp-contract=fast" in fast and "-ffp-contract=off" in exact
    assert not [flag for flag in exact if "native" in flag]
    assert "-ffast-math" not in fast + exact


def test_description_tells_no_folder(monkeypatch):
    monkeypatch.setenv("CC", f"{shutil.which('cc')} -pipe")
    described = compiler.describe_compiler()
    assert described["command"] == "cc -pipe"
    assert described["version"]

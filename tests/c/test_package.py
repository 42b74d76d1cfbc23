"""The folder of a model as a package for C: it builds alone, explains itself, and analysers find
nothing.
"""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from tests.c.target.emitted import C99, bits, library_of, model_of, needs, run, states_of
from tests.support import zoo
from tests.support.rows import row
from tests.support.toolchains import board, cppcheck

BARE = {"PATH": "/usr/bin:/bin", "LC_ALL": "C"}  # nothing of this project


@pytest.fixture
def package(tmp_path):
    """Return a function from a name to a copy of that model's folder, away from all else."""
    return lambda name: shutil.copytree(zoo.folder(name), tmp_path / name)


@pytest.mark.parametrize("name", ["bare", "small", pytest.param("polar", marks=pytest.mark.slow)])
def test_library_and_example_are_built_by_make_and_by_the_command_of_the_example(package, name):
    folder = package(name)
    assert run("make", "-s", "all", "example", cwd=folder, env=BARE) == ""
    assert (folder / "build" / f"lib{name}.a").is_file()
    assert_example(folder, run(folder / "build" / "example"))
    run("make", "-s", "clean", cwd=folder, env=BARE)
    assert not (folder / "build").exists()
    command = re.search(r"Build: (cc .*) \*/", (folder / "example" / "main.c").read_text())[1]
    run("sh", "-c", command, cwd=folder)
    assert_example(folder, run(folder / "a.out"))


def assert_example(folder, printed):
    """It prints the accelerations, or the torques, of the states that its comments describe."""
    model = st.load(folder)
    q, v, tau = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.layout.nt)
    q[3] = 1
    if "pfl" in model.kernels:  # a control loop, with stiffness and damping
        assert printed.count("\n") == 5
        for tick, line in enumerate(printed.splitlines()):
            q[7:] = 0.5 / (1 + tick)
            expected = model.pfl(q, v, -400 * q[7:] - 40 * v[6:])
            found = [float(number) for number in line.partition("tau = ")[2].split()]
            np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-9)
        return
    q[7], v[3], tau[0] = 0.5, 1, 1e-4
    if model.manifest["scene"]["coordinates"] == "polar":
        q[7:] = [0, 0.5] * (model.layout.nt // 2)
    found = [float(number) for number in re.findall(r"v_dot\[\d+\] = (\S+)", printed)]
    np.testing.assert_allclose(found, model.forward_dynamics(q, v, tau), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(
    ("board_name", "name"), [("m7", "bare"), pytest.param("m4", "small", marks=pytest.mark.slow)]
)
def test_makefile_builds_for_a_microcontroller_as_it_says(package, board_name, name):
    board(board_name)
    folder = package(name)
    lines = r"#   make (CC=\S+ AR=\S+) \\\n#\s+(CFLAGS=\".*?\")"
    command = re.search(lines, (folder / "Makefile").read_text())
    assert f"cortex-{board_name}" in command[2]
    run("sh", "-c", f"make -s {command[1]} {command[2]}", cwd=folder)
    (library,) = folder.glob("build/*.a")
    assert "elf32-littlearm" in run("arm-none-eabi-objdump", "-f", library)


@needs("cmake")
def test_cmake_builds_library_and_example(package):
    folder = package("bare")
    run("cmake", "-S", folder, "-B", folder / "build", env=BARE)
    run("cmake", "--build", folder / "build", env=BARE)
    assert_example(folder, run(folder / "build" / "bare_example"))


@pytest.mark.slow
@needs("cmake")
def test_another_project_adds_two_models(package, tmp_path):
    """Two prefixes in one program, each by add_subdirectory; no example comes along."""
    names = ["bare", "small"]
    lines = ["cmake_minimum_required(VERSION 3.10)", "project(own C)"]
    lines += [f"add_subdirectory({package(name)} {name})" for name in names]
    lines += ["add_executable(own own.c)", f"target_link_libraries(own {' '.join(names)})"]
    (tmp_path / "CMakeLists.txt").write_text("\n".join(lines))
    includes = "".join(f'#include "{name}.h"\n' for name in names)
    sizes = " + ".join(f"{name.upper()}_NV" for name in names)
    main = f"{includes}int main(void)\n{{\n  return {sizes} == 16 ? 0 : 1;\n}}\n"
    (tmp_path / "own.c").write_text(main)
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", env=BARE)
    run("cmake", "--build", tmp_path / "build", env=BARE)
    run(tmp_path / "build" / "own")
    assert not list((tmp_path / "build").rglob("*_example"))


def test_readme_names_every_function_and_symbol_that_the_header_has():
    for name in ("bare", "small", "polar", "ground_arcs"):
        folder = zoo.folder(name)
        readme = (folder / "README.md").read_text()
        header = (folder / "include" / f"{name}.h").read_text()
        listed = set(re.findall(r"^\| `(\w+)` \| (?:loops|lanes|segments|straight)", readme, re.M))
        with row(name):
            assert listed == set(re.findall(rf"^int {name}_(\w+)\(", header, re.M))
            words = re.findall(rf"\b(?:{name}|{name.upper()})_\w+\b(?!\.)", readme)
            assert [word for word in words if word not in header] == []
            files = r"`((?:include|src|example)/\S+|Makefile|CMakeLists\.txt|\w+\.json)`"
            assert all((folder / file).is_file() for file in re.findall(files, readme))
            own = Path(__file__).parents[2] / "LICENSE"
            assert (folder / "LICENSE").read_text() == own.read_text()


# Analysers


@pytest.mark.slow
def test_analysers_find_nothing(tmp_path):
    """GCC's: all but reads of what is unset, for it does not follow loops; the next test sees to
    that.
    """
    cppcheck()
    flags = (*C99, "-O2", "-fanalyzer", "-Wno-analyzer-use-of-uninitialized-value")
    arc = {"functions": ("mass_matrix", "forward_dynamics"), "emission": "loops"}
    for model in (model_of("bare"), model_of("arcs1", **arc)):
        command = (*flags, "-I", model.include, "-c", model.source, "-o", tmp_path / "model.o")
        with row(model.name):
            assert run("gcc", *command) == ""
            assert faults(model.folder) == ""
    assert faults(zoo.folder("small")) == ""
    (tmp_path / "src").mkdir()
    source = tmp_path / "src" / f"{tmp_path.name}.c"
    source.write_text("int f(void);\nint f(void)\n{\n  int x[2];\n  return x[2];\n}\n")
    assert "out of bounds" in faults(tmp_path)


def faults(folder):
    """What cppcheck finds in a model's source."""
    checks = "--enable=warning,performance,portability"
    words = ("cppcheck", "--std=c99", "--quiet", checks, "-I", folder / "include")
    words += (folder / "src" / f"{folder.name}.c",)
    return subprocess.run(words, capture_output=True, text=True, check=True).stderr


@pytest.mark.parametrize(
    ("name", "level"), [("small", "-O0"), pytest.param("m1_n1", "-O2", marks=pytest.mark.slow)]
)
def test_nothing_depends_on_what_a_local_variable_held(name, level):
    """Locals full of zeros, then full of a pattern: the same bits."""
    model = model_of(name)
    blank, dirty = (
        library_of(model, level, f"-ftrivial-auto-var-init={fill}") for fill in ("zero", "pattern")
    )
    for state in states_of(model):
        for function in model.manifest["functions"]:
            with row(function):
                assert bits(blank.call(function, state)) == bits(dirty.call(function, state))

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
from embedded import misra
from tests.c.target.emitted import C99, Library, Model, bits, needs, run, states_of
from tests.support.models import model_folder
from tests.support.toolchains import board, cppcheck

BARE = {"PATH": "/usr/bin:/bin", "LC_ALL": "C"}  # nothing of this project
FLIGHT = ["mass_matrix", "forward_dynamics"]
MODELS = {
    "flight": ((1, 3), {"functions": FLIGHT, "emission": "loops"}),
    "reproducible": ((1, 1), {"functions": FLIGHT, "profile": "reproducible", "real": "float"}),
    "contact": (
        (1, 2),
        {
            "functions": ["pfl", "contact_dynamics"],
            "contacts": ["feet", "tail"],
            "emission": "loops",
        },
    ),
    "arc": ((1, None), {"functions": FLIGHT, "emission": "loops", "real": "float"}),
}
SLOW = ("reproducible", "arc")
every_model = pytest.mark.parametrize("name", MODELS)


def model_of(name):
    """A generated model."""
    size, options = MODELS[name]
    return Model(f"package_{name}", *size, **options)


@pytest.fixture
def package(tmp_path):
    """Return a function from a name to a copy of that model's folder, away from all else."""
    return lambda name: shutil.copytree(model_of(name).folder, tmp_path / name)


@pytest.mark.parametrize(
    "name", ["flight", "contact", *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)]
)
def test_makefile_builds_library_and_example(package, name):
    folder = package(name)
    assert run("make", "-s", "all", "example", cwd=folder, env=BARE) == ""
    assert (folder / "build" / f"libpackage_{name}.a").is_file()
    printed = run(folder / "build" / "example")
    if name == "contact":
        assert re.search(r"tau = -?\d", printed), printed
    else:
        assert_example(folder, printed)
    run("make", "-s", "clean", cwd=folder, env=BARE)
    assert not (folder / "build").exists()


def assert_example(folder, printed):
    """It prints the accelerations of the state that its comments describe."""
    model = st.load(folder)
    q, v, tau = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.layout.nt)
    q[3], q[7], v[3], tau[0] = 1, 0.5, 1, 1e-4
    if model.manifest["scene"]["coordinates"] == "polar":
        q[7:] = [0, 0.5] * (model.layout.nt // 2)
    found = [float(number) for number in re.findall(r"v_dot\[\d+\] = (\S+)", printed)]
    np.testing.assert_allclose(found, model.forward_dynamics(q, v, tau), rtol=1e-4, atol=1e-6)


def test_the_control_loop_brings_the_tail_straight(package):
    """Its torques are those of the accelerations that its stiffness and damping ask for."""
    folder = package("contact")
    run("make", "-s", "example", cwd=folder, env=BARE)
    lines = run(folder / "build" / "example").splitlines()
    model = st.load(folder)
    for tick, line in enumerate(lines):
        q, v = np.zeros(model.nq), np.zeros(model.nv)
        q[3], q[7:] = 1, 0.5 / (1 + tick)
        expected = model.pfl(q, v, -400 * q[7:] - 40 * v[6:])
        found = [float(number) for number in line.partition("tau = ")[2].split()]
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-12)
    assert len(lines) == 5


@pytest.mark.parametrize("name", ["m4", "m7"])
def test_makefile_builds_for_a_microcontroller_as_it_says(package, name):
    board(name)
    folder = package("reproducible" if name == "m4" else "flight")
    command = re.search(
        r"#   make (CC=\S+ AR=\S+) \\\n#\s+(CFLAGS=\".*?\")", (folder / "Makefile").read_text()
    )
    assert f"cortex-{name}" in command[2]
    run("sh", "-c", f"make -s {command[1]} {command[2]}", cwd=folder)
    (library,) = folder.glob("build/*.a")
    assert "elf32-littlearm" in run("arm-none-eabi-objdump", "-f", library)


@needs("cmake")
def test_cmake_builds_library_and_example(package):
    folder = package("reproducible")
    run("cmake", "-S", folder, "-B", folder / "build", env=BARE)
    run("cmake", "--build", folder / "build", env=BARE)
    assert_example(folder, run(folder / "build" / "package_reproducible_example"))


@pytest.mark.slow
@needs("cmake")
def test_another_project_adds_two_models(package, tmp_path):
    """Two prefixes in one program, each by add_subdirectory; no example comes along."""
    names = ["flight", "contact"]
    lines = [f"add_subdirectory({package(name)} {name})" for name in names]
    libraries = " ".join(f"package_{name}" for name in names)
    lines += ["add_executable(own own.c)", f"target_link_libraries(own {libraries})"]
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.10)\nproject(own C)\n" + "\n".join(lines)
    )
    includes = "".join(f'#include "package_{name}.h"\n' for name in names)
    sizes = " + ".join(f"PACKAGE_{name.upper()}_NV" for name in names)
    (tmp_path / "own.c").write_text(
        f"{includes}int main(void)\n{{\n  return {sizes} == 16 ? 0 : 1;\n}}\n"
    )
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", env=BARE)
    run("cmake", "--build", tmp_path / "build", env=BARE)
    run(tmp_path / "build" / "own")
    assert not list((tmp_path / "build").rglob("*_example"))


@every_model
def test_a_cpp_compiler_takes_the_source(package, tmp_path, name):
    folder = package(name)
    source = folder / "src" / f"package_{name}.c"
    flags = ("-x", "c++", "-std=c++11", "-Wall", "-Wextra", "-Werror", "-I", folder / "include")
    run("g++", *flags, "-c", source, "-o", tmp_path / "model.o")


def test_a_cpp_compiler_takes_a_rollout(tmp_path):
    model = Model("package_rollout", 1, 1, functions=["forward_dynamics", "rollout"])
    run(
        "g++",
        "-x",
        "c++",
        "-Wall",
        "-Werror",
        "-I",
        model.include,
        "-c",
        model.source,
        "-o",
        tmp_path / "model.o",
    )


@every_model
def test_readme_names_every_function_and_symbol_that_the_header_has(package, name):
    folder = package(name)
    readme, header = (
        (folder / "README.md").read_text(),
        (folder / "include" / f"package_{name}.h").read_text(),
    )
    listed = set(re.findall(r"^\| `(\w+)` \| (?:loops|straight)", readme, re.MULTILINE))
    declared = set(re.findall(rf"^int package_{name}_(\w+)\(", header, re.MULTILINE))
    assert listed == declared
    assert all(
        word in header
        for word in re.findall(rf"\b(?:package|PACKAGE)_{name}_\w+\b(?!\.)", readme, re.IGNORECASE)
    )
    for file in re.findall(
        r"`((?:include|src|example)/\S+|Makefile|CMakeLists\.txt|\w+\.json)`", readme
    ):
        assert (folder / file).is_file(), file


def test_licence_is_the_project_s(package):
    own = Path(__file__).parents[2] / "LICENSE"
    assert (package("flight") / "LICENSE").read_text() == own.read_text()


# Analysers.


@pytest.mark.slow
@every_model
def test_gcc_s_analyser_finds_nothing(package, tmp_path, name):
    """All but reads of what is unset: the analyser does not follow loops; the next test sees to
    that.
    """
    folder = package(name)
    flags = (
        *C99,
        "-O2",
        "-fanalyzer",
        "-Wno-analyzer-use-of-uninitialized-value",
        "-I",
        folder / "include",
    )
    assert (
        run("gcc", *flags, "-c", folder / "src" / f"package_{name}.c", "-o", tmp_path / "model.o")
        == ""
    )


@every_model
@pytest.mark.parametrize("level", ["-O0", pytest.param("-O2", marks=pytest.mark.slow)])
def test_nothing_depends_on_what_a_local_variable_held(name, level):
    """Locals full of zeros, then full of a pattern: the same bits."""
    model = model_of(name)
    blank, dirty = (
        Library(model, level, f"-ftrivial-auto-var-init={fill}") for fill in ("zero", "pattern")
    )
    rng = np.random.default_rng(4)
    more = {
        "accelerations": rng.uniform(-1, 1, 2),
        "bristles": np.zeros(100),
        "legs": rng.uniform(-1, 1, 8),
    }
    for state in states_of(model):
        for function, entry in model.manifest["functions"].items():
            lengths = {a["name"]: int(np.prod(a["shape"])) for a in entry["inputs"]}
            given = {key: (state | more)[key][:length] for key, length in lengths.items()}
            assert bits(blank.call(function, given)) == bits(dirty.call(function, given)), function


def test_a_local_variable_that_is_read_unset_would_be_found(tmp_path):
    """The control: two fills, two results."""
    source = tmp_path / "unset.c"
    source.write_text(
        "int main(void)\n{\n  volatile int x[2];\n  return x[1] & 1 ? 0 : x[1] != 0;\n}\n"
    )
    found = []
    for fill in ("zero", "pattern"):
        run("gcc", f"-ftrivial-auto-var-init={fill}", source, "-o", tmp_path / fill)
        found.append(subprocess.run([tmp_path / fill], check=False).returncode)
    assert found[0] != found[1]


@pytest.mark.slow
@every_model
def test_cppcheck_finds_nothing(name):
    cppcheck()
    assert misra.faults(model_of(name).folder) == ""


def test_cppcheck_would_find_a_fault_and_misra_is_counted(tmp_path):
    cppcheck()
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / f"{tmp_path.name}.c").write_text(
        "int f(void);\nint f(void)\n{\n  int x[2];\n  return x[2];\n}\n"
    )
    assert "out of bounds" in misra.faults(tmp_path)
    found = misra.summary(model_folder(1, 1, functions=["mass_matrix"], emission="loops"))
    assert {rule: hits for rule, _, hits in found}["12.1"] > 10
    assert all(asks for _, asks, _ in found), found

"""Microcontrollers: models give the host's bits, their stack is what their frames add up to, their
costs are true.
"""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from embedded import boards, comparison, image, results, stack
from tests.support.models import model_folder
from tests.support.toolchains import board

ROOT = boards.HERE.parent
CROSS = [name for name in boards.BOARDS if name != "host"]
REAL = {"m4": "float", "m7": "double", "rv32": "double"}
FUNCTIONS = ["mass_matrix", "forward_dynamics", "pfl", "contact_dynamics"]
LIBC_STACK = 16  # bytes: what memset and memcpy push, which no call graph of ours has
NOT_TAKEN = (
    128  # bytes: branches that the stored states do not take, such as angles beyond all reason
)


def folder(name, profile, segments=1, links=3, **options):
    """A generated model with contact for a board."""
    options = {
        "functions": FUNCTIONS,
        "contacts": ["feet"],
        "real": REAL[name],
        "profile": profile,
    } | options
    return model_folder(segments, links, **options)


def compared(tmp_path, name, profile, **options):
    """Every function of a model on a board beside the host."""
    board(name)
    return {
        row.name: row
        for row in comparison.compare(folder(name, profile, **options), name, tmp_path)
    }


@pytest.mark.parametrize("name", CROSS)
def test_reproducible_models_have_the_host_s_bits_everywhere(tmp_path, name):
    rows = compared(tmp_path, name, "reproducible")
    assert set(rows) == set(FUNCTIONS)
    assert all(row.same_bits and row.units == 0 for row in rows.values())
    assert_stack_is_the_sum_of_frames(rows)


def assert_stack_is_the_sum_of_frames(rows):
    """What the paint shows is the deepest chain of calls, or a little less where a branch is not
    taken.
    """
    for row in rows.values():
        assert 0 < row.painted <= row.stack + LIBC_STACK, row
        assert row.painted >= row.stack - NOT_TAKEN, row


SLOW_FORMS = [
    ("m4", (1, 3), "loops"),
    ("m7", (3, 4), "loops"),
    ("m7", (1, None), "loops"),
    ("m4", (1, None), "straight"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "tail", "emission"), SLOW_FORMS)
@pytest.mark.parametrize("profile", boards.PROFILES)
def test_profiles_keep_their_promises_in_every_form(tmp_path, name, tail, emission, profile):
    more = [
        *FUNCTIONS,
        "inverse_dynamics",
        "energy",
        "momentum",
        "tail_points",
        "forward_dynamics_derivatives",
    ]
    sizes = {"segments": tail[0], "links": tail[1]}
    rows = compared(tmp_path, name, profile, **sizes, emission=emission, functions=more)
    assert all(row.holds(profile) for row in rows.values()), "\n".join(
        comparison.table(list(rows.values()))
    )
    assert_stack_is_the_sum_of_frames(rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tail", "emission", "instructions"),
    [
        ("m4", (1, 3), "loops", 7000),
        ("m4", (1, 3), "straight", 3500),
        ("m7", (3, 4), "loops", 22000),
        ("m7", (3, 4), "straight", 22000),
    ],
)
def test_forward_dynamics_keeps_its_budget(tmp_path, name, tail, emission, instructions):
    options = {"functions": ["forward_dynamics"], "contacts": [], "emission": emission}
    row = compared(tmp_path, name, "fast", segments=tail[0], links=tail[1], **options)[
        "forward_dynamics"
    ]
    assert row.instructions <= instructions
    assert row.stack <= 2560  # bytes


@pytest.mark.slow
@pytest.mark.parametrize(("name", "tail"), [("m4", (1, 3)), ("m4", (3, 4)), ("m7", (1, 3))])
def test_forward_dynamics_in_loops_is_small(tmp_path, name, tail):
    from embedded import size_tables

    model = folder(
        name, "fast", *tail, functions=["forward_dynamics"], contacts=[], emission="loops"
    )
    assert (
        size_tables.flash(image.build(model, board(name), tmp_path), "forward_dynamics") <= 6 * 1024
    )


# The instruments.

LOOP = {
    "m4": "mov r0, #1000\\n1: subs r0, r0, #1\\n\\tbne 1b",
    "m7": "mov r0, #1000\\n1: subs r0, r0, #1\\n\\tbne 1b",
    "rv32": "li t0, 1000\\n1: addi t0, t0, -1\\n\\tbnez t0, 1b",
}
COUNTING = """#include "port.h"
int main(void)
{
  port_start_counting();
  for (int k = 0; k < 50; ++k) {
    __asm__ volatile("LOOP" ::: "REGISTER", "memory");
  }
  const uint32_t counted = port_counted() / 50;
  return counted >= 2001 && counted < 2010 ? 0 : 5;
}
"""


@pytest.mark.parametrize("name", CROSS)
def test_instructions_are_counted_one_by_one(tmp_path, name):
    """A loop of 1000 turns is 2001 instructions, and a few around it."""
    machine, source = board(name), tmp_path / "main.c"
    source.write_text(
        COUNTING.replace("LOOP", LOOP[name]).replace("REGISTER", "t0" if name == "rv32" else "r0")
    )
    elf = str(tmp_path / "count.elf")
    sources = [str(source), machine.port]
    image.command(
        [machine.compiler, *machine.cpu, "-O2", "-I.", *machine.link, *sources, "-o", elf]
    )
    assert subprocess.run([*machine.emulator, elf], check=False).returncode == 0


def result(values, status=0):
    """A result of one function on one state, in double."""
    values = np.array([values])
    return results.Result((status,), values.view(np.uint64), values, (10,), (20,))


@pytest.fixture
def host_image(tmp_path):
    """The check of a small model, built for the host."""
    model = model_folder(1, 1, functions=["forward_dynamics"], profile="reproducible")
    return image.build(model, boards.BOARDS["host"], tmp_path)


def test_a_wrong_bit_fails(host_image):
    exact = results.run(host_image)["forward_dynamics"].values[0]
    depths = {"call_forward_dynamics": 20, "call_room": 0}
    expected = {
        0.0: (True, True),
        1e-15: (False, True),
        1e-9: (False, False),
        np.nan: (False, False),
    }
    for off, kept in expected.items():
        other = exact + off * np.abs(exact).max()
        row = comparison._compared(
            host_image, "forward_dynamics", result(other), result(exact), depths
        )
        assert (row.holds("reproducible"), row.holds("fast")) == kept, off


def test_another_status_is_an_error(host_image):
    ones = result(np.ones(8))
    with pytest.raises(
        RuntimeError, match=r"forward_dynamics: status \(1,\) on host, \(0,\) on the host"
    ):
        comparison._compared(host_image, "forward_dynamics", replace(ones, statuses=(1,)), ones, {})


def test_stored_states_are_the_same_in_both_precisions(host_image):
    rows = np.hstack(list(host_image.states.values()))
    assert np.array_equal(rows, rows.astype(np.float32)) and len(rows) > 1


GRAPH = """node: {{ title: "f" label: "f\\na.c:1:1\\n{size} bytes ({kind})" }}
node: {{ title: "a.c:g" label: "g\\na.c:2:1\\n40 bytes (static)" }}
node: {{ title: "sin" label: "sin\\nmath.h" shape : ellipse }}
edge: {{ sourcename: "f" targetname: "a.c:g" label: "a.c:3:1" }}
edge: {{ sourcename: "a.c:g" targetname: "{callee}" label: "a.c:4:1" }}
"""


def deepest(tmp_path, **values):
    path = tmp_path / "a.ci"
    path.write_text(GRAPH.format(**{"size": 100, "kind": "static", "callee": "sin"} | values))
    return stack.deepest([path])


def test_stack_adds_up_along_calls(tmp_path):
    assert deepest(tmp_path) == {"f": 140, "g": 40}


@pytest.mark.parametrize(
    ("values", "message"),
    [({"callee": "f"}, "it calls itself"), ({"kind": "dynamic"}, "its frame is dynamic")],
)
def test_stack_that_cannot_be_known_is_an_error(tmp_path, values, message):
    with pytest.raises(stack.StackUnknown, match=message):
        deepest(tmp_path, **values)


@pytest.mark.parametrize("name", CROSS)
def test_missing_tools_are_named_with_their_packages(tmp_path, name):
    command = [sys.executable, "-m", "embedded.check", str(folder(name, "fast")), "--board", name]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        env={"PATH": "", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert boards.BOARDS[name].compiler in done.stderr and "not on PATH" in done.stderr
    assert (
        f"apt-get install --no-install-recommends {' '.join(boards.BOARDS[name].packages)}"
        in done.stderr
    )


def test_size_report_names_missing_tools(tmp_path):
    before = (ROOT / "docs" / "embedded.md").read_bytes()
    command = [sys.executable, "-m", "embedded.size_report"]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        env={"PATH": "", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (
        done.returncode == 2 and "apt-get install" in done.stderr and "Traceback" not in done.stderr
    )
    assert (ROOT / "docs" / "embedded.md").read_bytes() == before


def test_ci_installs_what_tests_of_c_need():
    script = (ROOT / ".ci" / "run").read_text()
    wanted = {package for name in CROSS for package in boards.BOARDS[name].packages}
    wanted |= {"cppcheck", "valgrind", "clang", "libclang-rt-14-dev"}
    assert [package for package in sorted(wanted) if package not in script.split()] == []
    assert "export CI=" in script

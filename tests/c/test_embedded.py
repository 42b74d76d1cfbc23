"""Microcontrollers: models and predictive control give the host's bits, their stack is what their
frames add up to, their costs are true.
"""

import subprocess

import numpy as np
import pytest

import serpentail as st
from checks.embedded import boards, comparison, costs, gains_image, image, mpc_image, results
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.predictive import plan_of
from tests.support.rows import row
from tests.support.toolchains import board

CROSS = [name for name in boards.BOARDS if name != "host"]
LIBC_STACK = 16  # bytes: what memset and memcpy push, which no call graph of ours has
# bytes: branches that the stored states do not take, such as angles beyond all reason
NOT_TAKEN = 128


def compared(folder, name, output, profile):
    """Every function of a model on a board beside the host; the stack is the sum of frames.

    What the paint shows is the deepest chain of calls, or a little less where a branch is not
    taken.
    """
    board(name)
    found = comparison.compare(folder, name, output, profile)
    assert all(one.holds(profile) for one in found), "\n".join(comparison.table(found))
    for one in found:
        with row(one):
            assert 0 < one.painted <= one.stack + LIBC_STACK
            assert one.painted >= one.stack - NOT_TAKEN
    return {one.name: one for one in found}


@pytest.mark.parametrize(
    ("name", "of"),
    [
        ("m4", "small"),
        *(pytest.param(n, "reproducible", marks=pytest.mark.slow) for n in CROSS[1:]),
    ],
)
def test_reproducible_models_have_the_host_s_bits(tmp_path, name, of):
    found = compared(zoo.folder(of), name, tmp_path, "reproducible")
    assert set(found) == set(image.manifest_of(zoo.folder(of))["functions"])
    assert all(one.same_bits and one.units == 0 for one in found.values())


@pytest.mark.slow
def test_fast_models_keep_their_promises_in_every_form(tmp_path):
    arc = ["mass_matrix", "forward_dynamics", "tail_points", "forward_dynamics_derivatives"]
    folders = [("m4", zoo.folder("small")), ("m7", zoo.folder("ground_m1_n1"))]
    folders.append(("m7", folder_of(zoo.scene("arcs1", functions=arc))))
    for name, folder in folders:
        with row(name, folder.name):
            compared(folder, name, tmp_path / folder.name, "fast")


@pytest.mark.slow
def test_forward_dynamics_keeps_its_budget(tmp_path):
    """Of a form and a size, which are the point: instructions, flash and stack."""
    sizes = [
        ("m4", "m1_n3", "loops", 7000, 6 * 1024),
        ("m4", "m1_n3", "straight", 3500, np.inf),
        ("m4", "m3_n4", "loops", 22000, 6 * 1024),
        ("m7", "m1_n3", "loops", 7000, 6 * 1024),
        ("m7", "m3_n4", "loops", 22000, np.inf),
        ("m7", "m3_n4", "straight", 22000, np.inf),
    ]
    for name, of, emission, instructions, flash in sizes:
        with row(name, of, emission):
            real, functions = boards.BOARDS[name].real, ["forward_dynamics"]
            scene = zoo.scene(of, functions=functions, emission=emission, real=real)
            folder, place = folder_of(scene), tmp_path / f"{name}_{of}_{emission}"
            found = compared(folder, name, place, "fast")["forward_dynamics"]
            assert found.instructions <= instructions and found.stack <= 2560
            built = image.build(folder, board(name), place)
            assert costs.flash(built, "forward_dynamics") == found.flash <= flash


# Predictive control


@pytest.mark.slow
def test_ticks_in_float_fit_100_hz_of_a_cortex_m7_at_480_mhz(tmp_path):
    board("m7")
    mpc = st.Mpc(zoo.model("single_ground"), plan_of(1), step=0.017)
    found = mpc_image.ticks(zoo.folder("single_ground"), mpc, "m7", tmp_path, "fast")
    assert found.failed == 0 and found.most < 480e6 / 100
    mpc.begin()
    for at in (0.2, 0.21):
        q, v = np.split(mpc_image.states_of(mpc)[2, 1:].reshape(2, -1)[round(at == 0.21)], [9])
        mpc(at, q, v)
    times = 0.21 + (mpc.plan.duration - 0.21) * np.arange(4) / 4
    own = np.concatenate([mpc.torque(at) for at in times])
    np.testing.assert_allclose(found.torques[2], own, atol=2e-4)


@pytest.mark.slow
def test_ticks_on_a_cortex_m7_have_the_host_s_bits(tmp_path):
    board("m7")
    folder = zoo.folder("reproducible")
    mpc = st.Mpc(zoo.model("reproducible"), plan_of(1))
    found = mpc_image.ticks(folder, mpc, "m7", tmp_path, "reproducible")
    assert found.same_bits and found.failed == 0
    assert 1e5 < found.instructions < found.most < 5e7 and 100 < found.stack < 4096
    assert found.code < 20_000 and found.memory < 20_000

    # as Python's, compiled otherwise
    for state, torques in zip(mpc_image.states_of(mpc), found.torques, strict=True):
        t, later = state[0], state[0] + 0.01
        q, v, next_q, next_v = np.split(state[1:], np.cumsum([9, 8, 9]))
        mpc.begin()
        mpc(t, q, v)
        mpc(later, next_q, next_v)
        times = later + (mpc.plan.duration - later) * np.arange(4) / 4
        own = np.concatenate([mpc.torque(at) for at in times])
        np.testing.assert_allclose(torques, own, atol=1e-9)
        assert np.abs(own - mpc.plan.torque(times).ravel()).max() > 1e-5


def test_the_controller_needs_nothing_but_the_model_and_memory(tmp_path):
    board("m7")
    for name, root in (("m1_n3", "sqrt"), ("single_ground", "sqrtf")):
        needs_nothing_else(zoo.folder(name), zoo.model(name), root, tmp_path)


def needs_nothing_else(folder, model, root, tmp_path):
    st.Mpc(model, plan_of(1)).write_c(tmp_path)
    flags = ["-std=c99", "-O2", "-c", "-I", str(folder / "include"), "-I", str(tmp_path)]
    source, made = tmp_path / f"{model.name}_mpc.c", tmp_path / "mpc.o"
    image.command(["arm-none-eabi-gcc", *flags, str(source), "-o", str(made)])
    told = image.command(["arm-none-eabi-nm", "-f", "posix", str(made)])
    symbols = [line.split()[:2] for line in told.splitlines()]
    arithmetic = {name for name, _ in symbols if name.startswith("__aeabi")}  # without an FPU
    undefined = {name for name, kind in symbols if kind == "U"} - arithmetic
    called = ("airborne_rates", "airborne_rates_derivatives", "momentum")
    outside = {"memcpy", "memset", root}
    assert undefined <= outside | {f"{model.name}_{name}" for name in called}
    assert not [name for name, kind in symbols if kind in "BbDdC"]  # nothing that is kept
    public = {name for name, kind in symbols if kind in "TRV"}
    assert public and all(name.startswith(f"{model.name}_mpc_") for name in public)


# Gains


def test_gains_on_a_cortex_m4f_have_the_host_s_bits_and_leave_room_for_1_khz(tmp_path):
    """A tick of a board at 168 MHz is 168000 cycles; the torques are Python's, in float."""
    board("m4")
    gains = st.Gains(plan_of(1), within=None)
    found, host = (
        gains_image.ticks(gains, name, tmp_path / name, "reproducible") for name in ("m4", "host")
    )
    assert (found.bits == host.bits).all() and set(found.statuses) == {0}
    assert 500 < max(found.instructions) < 2000
    for state, torques in zip(gains_image.states_of(gains), found.values, strict=True):
        t, q, v = np.split(state.astype(float), [1, 10])
        np.testing.assert_allclose(torques, gains(t[0], q, v), atol=1e-5)
        assert np.abs(torques - gains.plan.torque(t)).max() > 1e-5


# The instruments.

ARM = "mov r0, #1000\\n1: subs r0, r0, #1\\n\\tbne 1b"
RISCV = "li t0, 1000\\n1: addi t0, t0, -1\\n\\tbnez t0, 1b"
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
    loop, register = (RISCV, "t0") if name == "rv32" else (ARM, "r0")
    source.write_text(COUNTING.replace("LOOP", loop).replace("REGISTER", register))
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


def test_wrong_bits_fail_and_another_status_is_an_error(tmp_path):
    built = image.build(zoo.folder("bare"), boards.BOARDS["host"], tmp_path, "reproducible")
    exact = results.run(built)["forward_dynamics"].values[0]
    depths = {"call_forward_dynamics": 20, "call_room": 0}

    def compare(values, status=0):
        found = result(values, status), result(exact)
        return comparison._compared(built, "forward_dynamics", *found, depths)

    offsets = {0.0: (True, True), 1e-15: (False, True), 1e-9: (False, False)}
    for off, kept in (offsets | {np.nan: (False, False)}).items():
        found = compare(exact + off * np.abs(exact).max())
        assert (found.holds("reproducible"), found.holds("fast")) == kept, off
    with pytest.raises(RuntimeError, match=r"status \(1,\) on host, \(0,\) on the host"):
        compare(exact, status=1)
    # stored states are the same in both precisions
    stored = np.hstack(list(built.states.values()))
    assert np.array_equal(stored, stored.astype(np.float32)) and len(stored) > 1


GRAPH = """node: {{ title: "f" label: "f\\na.c:1:1\\n{size} bytes ({kind})" }}
node: {{ title: "a.c:g" label: "g\\na.c:2:1\\n40 bytes (static)" }}
node: {{ title: "sin" label: "sin\\nmath.h" shape : ellipse }}
edge: {{ sourcename: "f" targetname: "a.c:g" label: "a.c:3:1" }}
edge: {{ sourcename: "a.c:g" targetname: "{callee}" label: "a.c:4:1" }}
"""


def test_stack_adds_up_along_calls_or_is_unknown(tmp_path):
    def deepest(size=100, kind="static", callee="sin"):
        path = tmp_path / "a.ci"
        path.write_text(GRAPH.format(size=size, kind=kind, callee=callee))
        return costs.deepest([path])

    assert deepest() == {"f": 140, "g": 40}
    for change, words in (({"callee": "f"}, "calls itself"), ({"kind": "dynamic"}, "dynamic")):
        with pytest.raises(costs.StackUnknown, match=words):
            deepest(**change)

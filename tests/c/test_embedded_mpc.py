"""Predictive control on a microcontroller: the host's bits, without a heap, and what it costs."""

import subprocess

import numpy as np

import serpentail as st
from embedded import mpc_image
from tests.support.models import model_folder
from tests.support.predictive import plan_of
from tests.support.toolchains import board
from tests.support.tumbling import FUNCTIONS, NODE

OUTSIDE = {"memcpy", "memset", "sqrt"}
CALLED = {"airborne_rates", "airborne_rates_derivatives", "momentum"}


def test_ticks_on_a_cortex_m7_have_the_host_s_bits(tmp_path):
    board("m7")
    functions = list(dict.fromkeys([*NODE, *FUNCTIONS]))
    folder = model_folder(1, 3, functions=functions, profile="reproducible")
    mpc = st.Mpc(st.load(folder), plan_of(1))
    found = mpc_image.ticks(folder, mpc, "m7", tmp_path, "reproducible")
    assert found.same_bits and found.failed == 0
    assert 1e5 < found.instructions < 5e7 and 100 < found.stack < 4096
    assert found.code < 20_000 and found.memory < 20_000

    # as Python's, compiled otherwise
    for row, torques in zip(mpc_image.states_of(mpc), found.torques, strict=True):
        t, later = row[0], row[0] + 0.01
        q, v, next_q, next_v = np.split(row[1:], np.cumsum([9, 8, 9]))
        mpc.begin()
        mpc(t, q, v)
        mpc(later, next_q, next_v)
        times = later + (mpc.plan.duration - later) * np.arange(4) / 4
        own = np.concatenate([mpc.torque(at) for at in times])
        np.testing.assert_allclose(torques, own, atol=1e-9)
        assert np.abs(own - mpc.plan.torque(times).ravel()).max() > 1e-5


def test_the_controller_needs_nothing_but_the_model_and_memory(tmp_path):
    board("m7")
    functions = list(dict.fromkeys([*NODE, *FUNCTIONS]))
    folder = model_folder(1, 3, functions=functions)
    model = st.load(folder)
    st.Mpc(model, plan_of(1)).write_c(tmp_path)
    flags = ["-std=c99", "-O2", "-c", "-I", str(folder / "include"), "-I", str(tmp_path)]
    source, made = tmp_path / f"{model.name}_mpc.c", tmp_path / "mpc.o"
    subprocess.run(["arm-none-eabi-gcc", *flags, str(source), "-o", str(made)], check=True)
    told = subprocess.run(
        ["arm-none-eabi-nm", "-f", "posix", str(made)], capture_output=True, text=True, check=True
    )
    symbols = [line.split()[:2] for line in told.stdout.splitlines()]
    arithmetic = {name for name, _ in symbols if name.startswith("__aeabi")}  # without an FPU
    undefined = {name for name, kind in symbols if kind == "U"} - arithmetic
    assert undefined <= OUTSIDE | {f"{model.name}_{name}" for name in CALLED}
    assert not [name for name, kind in symbols if kind in "BbDdC"]  # nothing that is kept
    public = {name for name, kind in symbols if kind in "TRV"}
    assert public and all(name.startswith(f"{model.name}_mpc_") for name in public)

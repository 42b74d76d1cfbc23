"""Ctrl-C: what takes long ends within a second, in one line, and keeps what is finished."""

import json
import os
import signal
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row
from tests.support.told import besides_progress

PROMPT = 1.0  # s
AFTER = (0.3, 1.0, 3.0)  # s of work; one try must be prompt: other work may hold up a process
PATIENCE = 60.0  # s to begin, and to end at the latest
# a shell's background may not hear Ctrl-C
HEAR = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)"
# does what each line of stdin tells until Ctrl-C, and tells what is kept
SERVES = f"""{HEAR}
import time, numpy as np, scipy.integrate, serpentail as st
from tests.processes.elsewhere import start
say = lambda *words: print(*words, flush=True)
model = st.load(sys.argv[1], threads=int(sys.argv[2]))
q, v = start(model)
many = np.tile(q, (10**6, 1)), np.tile(v, (10**6, 1))
for line in sys.stdin:
    call, told = (eval("lambda: " + part) for part in line.split("|"))
    say("ready")
    try:
        while True:
            call()
    except KeyboardInterrupt as stop:
        ended, motion = time.monotonic(), getattr(stop, "motion", None)
        say(ended, *([] if motion is None else told()(motion)))
"""
# what takes long, and what is told of what is kept
BEGUN = "lambda m: (float(m.t[-1]) > 0, bool(np.isfinite(m.q).all()))"
SOME = "lambda m: (any(e is None for e in m.errors), sum(e is not None for e in m.errors) > 1)"
LONG = {
    "simulate(model, q, v, t_span=1e5, output_step=1.0, method='rk4', step=1e-4)": BEGUN,
    "simulate(model, q, v, t_span=1e4, output_step=0.01, controller=lambda *_: [0, 0])": BEGUN,
    "simulate(model, q, v, t_span=1e4, output_step=0.01, method='dop853')": BEGUN,
    "simulate(model, np.tile(q, (10**4, 1)), v, t_span=1, output_step=0.1, rtol=1e-12)": SOME,
    "Model.forward_dynamics(model, *many, [0, 0])": None,
}


@pytest.mark.parametrize("threads", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_what_takes_long_ends_and_keeps_what_there_is(child, threads):
    process = child("-c", SERVES, zoo.folder("m1_n3"), threads)
    for call, told in LONG.items():
        expected, found = [] if told is None else ["True", "True"], []
        for after in AFTER:
            process.stdin.write(f"st.{call}|{told}\n")
            process.stdin.flush()
            assert process.stdout.readline() == "ready\n"
            time.sleep(after)
            asked = time.monotonic()
            process.send_signal(signal.SIGINT)
            ended, *kept = process.stdout.readline().split()
            found.append((kept, float(ended) - asked))
            if kept == expected and found[-1][1] <= PROMPT:
                break
        else:
            raise AssertionError((call, found))
    said, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, said, errors) == (0, "", "")


COMMAND = f"""{HEAR}
from serpentail.cli.cli import main
print("ready", file=sys.stderr, flush=True)
sys.exit(main(sys.argv[1:]))
"""
SCENE = """
name = "m1_n3"
kind = "articulated"
segments = 1
links = 3
[simulate]
duration = 500.0
output_step = 5e-4
method = "rk4"
step = 5e-6
start = {height = 1.0, rate = [0.1, 0.2, 0.3]}
[plan]
duration = 0.4
intervals = 60
retries = 50
multi_start = 50
tolerance = 1e-9
start = {q = [0, 0, 0.3, 0.9, 0.43, 0, 0, 0.1, 0], v = [0, -0.3, 2.4, 1, 2, 1, 0, 0]}
"""


@pytest.mark.parametrize("verb", ["simulate", "plan"])
def test_a_command_ends_in_one_line_and_writes_what_there_is(child, tmp_path, verb):
    scene, saved = tmp_path / "scene.toml", tmp_path / "motion.npz"
    scene.write_text(SCENE)
    options = "--folder", zoo.model("m1_n3").folder, "--json", "-", "--save", saved
    process = child("-c", COMMAND, verb, scene, *options)
    while not process.stderr.readline().startswith(verb):  # it tells of itself after a second
        assert process.poll() is None
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    said, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert besides_progress(errors) == "serpentail: interrupted; this is the result until then\n"
    assert json.loads(said)["stopped"] == "interrupt"
    motion = st.Trajectory.load(saved)
    assert len(motion.t) > 1 and np.isfinite(motion.q).all()
    assert set(tmp_path.iterdir()) == {scene, saved}


WHILE_IMPORTING = f"""{HEAR}
import os
class Stop:
    def find_spec(name, *_):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
import serpentail  # by itself it imports what Python has imported already
sys.meta_path.insert(0, Stop)
from serpentail.cli.cli import main
sys.exit(main(["simulate", "kick"]))
"""
PARTS = (
    "argparse",
    "serpentail.basics.errors",
    "serpentail.basics.progress",
    "serpentail.cli.arguments",
)
PARTS += ("serpentail.cli.motions", "serpentail.scenes.simulate", "numpy")


def test_a_command_ends_in_a_line_at_most_while_it_imports(child):
    running = {part: child("-c", WHILE_IMPORTING, part) for part in PARTS}
    for part, process in running.items():
        with row(part):
            said, errors = process.communicate(timeout=PATIENCE)
            assert (process.returncode, said) == (130, "")
            assert errors in ("", "serpentail: interrupted\n")


SLOW_CC = """#!/bin/sh
for last; do :; done
case " $* " in *" -c "*) echo "$$" >> {pids}; sleep 60 & echo "$!" >> {pids}; wait;; esac
exec cc "$@"
"""


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, -15)])
def test_a_compile_leaves_no_compiler_and_no_half_file(child, tmp_path, number, status):
    folder = zoo.folder("bare")
    compiler, pids, cache = tmp_path / "cc", tmp_path / "pids", tmp_path / "cache"
    compiler.write_text(SLOW_CC.format(pids=pids))
    compiler.chmod(0o755)
    environment = os.environ | {"CC": str(compiler), "SERPENTAIL_CACHE": str(cache)}
    process = child("-c", COMMAND, "info", folder, env=environment)
    assert process.stderr.readline() == "ready\n"
    until(lambda: pids.exists() and len(pids.read_text().split()) >= 2)
    time.sleep(1.0)  # all sources are being compiled
    process.send_signal(number)
    begun = time.monotonic()
    said, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, said) == (status, "")
    if number == signal.SIGINT:
        assert time.monotonic() - begun < PROMPT
        assert besides_progress(errors) == "serpentail: interrupted\n"
        until(lambda: not any(alive(int(pid)) for pid in pids.read_text().split()))
        assert not [path for path in cache.rglob("*") if path.suffix in (".part", ".o", ".so")]
    else:
        for pid in filter(alive, map(int, pids.read_text().split())):
            os.kill(pid, signal.SIGKILL)
    # what comes next finds nothing broken
    environment |= {"CC": os.environ.get("CC", "cc")}
    again = child("-c", COMMAND, "info", folder, env=environment)
    said = again.communicate(timeout=PATIENCE)[1]
    assert besides_progress(said) == "ready\n" and again.returncode == 0


def until(condition) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def alive(pid: int) -> bool:
    """Tell whether a process runs, and is no mere entry of the system's table."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False

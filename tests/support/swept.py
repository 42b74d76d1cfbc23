"""Functions that sweeps run in tests, and a program that runs a sweep and can be killed."""

import ctypes
import os
import signal
import sqlite3
import sys
import time
from contextlib import closing
from functools import partial
from pathlib import Path

import serpentail as st

POINTS, HANGS, CRASHES, RAISES, SLEEPS = 60, (33,), (9, 40), (12,), (99,)
TEXT = "a row of a size that a small disk notices" * 5


def stored(path):
    """Read a store as another program does: point, outcome, error."""
    if not path.exists():
        return []
    with closing(sqlite3.connect(path)) as base:
        begun = base.execute("SELECT name FROM sqlite_master").fetchall()
        return base.execute("SELECT point, outcome, error FROM rows").fetchall() if begun else []


def square(point):
    """A closed form."""
    return {"square": point["x"] ** 2}


def numbers(point):
    """The numbers of a point."""
    return {"told": [point["a"], point.get("d"), point["b"]]}


def troubled(pause, log, point):
    """Return twice a number; some numbers take for ever, crash, raise or sleep."""
    number = point["number_of"]
    with Path(log).open("a") as stream:
        stream.write(f"{number}\n")
    while number in HANGS:
        pass
    if number in SLEEPS:
        time.sleep(1000)
    if number == CRASHES[0]:
        ctypes.string_at(0)
    if number in CRASHES:
        os._exit(3)
    if number in RAISES:
        raise ValueError("no such number")
    time.sleep(pause)
    return {"twice": 2 * number, "text": TEXT}


def part(folder, result=None):
    """Return the result of a part of a study; each call writes a line."""
    with open(folder / "made", "a") as file:
        file.write("once\n")
    return {"third": 1 / 3, "lost": float("nan")} if result is None else result / 0


def fly(model, point):
    """A motion, and the model's mass, which the point changes."""
    q = [0, 0, 0.3, 1, 0, 0, 0, *[0] * (model.nq - 7)]
    motion = st.simulate(model, q, [0] * model.nv, t_span=point["span"])
    return {
        "fallen": motion.q[0, 2] - motion.q[-1, 2],
        "mass": model.parameters["tail_mass"],
        "motion": motion,
    }


def study(folder, pause):
    """The troubled sweep."""
    run = partial(troubled, pause, str(folder / "log"))
    over = {"number_of": st.grid(range(POINTS))}
    return {"model": None, "over": over, "run": run, "store": folder / "s.rows"}


def main(folder, executor, pause):
    """Run the troubled sweep, and print its progress."""
    print(st.sweep(**study(folder, pause), limit=1.0, executor=executor).status())


if __name__ == "__main__":
    from tests.support.swept import main  # whose functions have the names that others see

    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        main(Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]))
    except st.SerpentailError as error:
        sys.exit(str(error))

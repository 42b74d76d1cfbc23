"""Sweeps whose parts are killed: after resuming, every row is there exactly once."""

import os
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from tests.support import swept

ROOT = Path(__file__).parents[2]
PATIENCE = 120  # s
PAUSE = "0.1"  # s that a point takes
FAILED = {*swept.HANGS, *swept.CRASHES, *swept.RAISES}


def python(*arguments, **settings):
    return subprocess.Popen(
        [sys.executable, "-m", *map(str, arguments)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **settings,
    )


def driver(folder, executor, **settings):
    return python("tests.support.swept", folder, executor, PAUSE, **settings)


def rows(folder):
    """The rows of a store, which any process may read meanwhile."""
    path = folder / "s.db"
    if not path.exists():
        return []
    base = sqlite3.connect(f"file:{path}?mode=ro", uri=True, timeout=10)
    try:
        return base.execute("select point, outcome, error from rows").fetchall()
    except sqlite3.OperationalError:  # it is being made
        return []
    finally:
        base.close()


def wait_for(count, folder, process):
    """Wait until a store has so many rows, or the process is over."""
    end = time.monotonic() + PATIENCE
    while len(rows(folder)) < count and process.poll() is None:
        assert time.monotonic() < end, process.args
        time.sleep(0.02)
    assert process.poll() is None, process.communicate()


def number_of(point):
    """The number in the text of a point."""
    return int(point.split(":")[1][:-1])


def check_whole(folder):
    """Every point has one row; the outcomes are those of a closed form."""
    found = {number_of(point): (outcome, error) for point, outcome, error in rows(folder)}
    assert sorted(found) == list(range(swept.POINTS)) and len(rows(folder)) == swept.POINTS
    for number, (outcome, error) in found.items():
        assert (error is not None) == (number in FAILED), (number, error)
        assert outcome == (None if number in FAILED else f'{{"twice": {2 * number}}}')
    assert all(found[n][1].startswith("TimeLimit") for n in swept.HANGS)
    assert all(found[n][1].startswith("ProcessEnded") for n in swept.CRASHES)
    base = sqlite3.connect(folder / "s.db")
    assert base.execute("pragma integrity_check").fetchone() == ("ok",)
    base.close()


def finish(folder, executor):
    """Let a sweep go on to its end, and check that a further call runs nothing."""
    printed, errors = driver(folder, executor).communicate(timeout=PATIENCE)
    told = f"{swept.POINTS} of {swept.POINTS} points done, {len(FAILED)} of them failed, 0 left\n"
    assert printed == told, errors
    log = (folder / "log").read_text()
    assert driver(folder, executor).communicate(timeout=PATIENCE)[0] == told
    assert (folder / "log").read_text() == log
    check_whole(folder)
    return Counter(map(int, log.split()))


def full():
    """Let no file of this process grow beyond a few rows, as a full disk would."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (36_000, 36_000))


def check_full(folder, executor):
    process = driver(folder, executor, preexec_fn=full)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1
    told = errors.splitlines()[-1]
    assert "is not written" in told and "make room" in told, errors
    assert 0 < len(rows(folder)) < swept.POINTS


@pytest.mark.slow
def test_a_full_disk_kills_and_ctrl_c_keep_the_rows(tmp_path):
    """On the same rows, one after the other: none is lost, and none that is there made again."""
    check_full(tmp_path, "processes:2")
    kept = {}
    for ending in (signal.SIGKILL, signal.SIGKILL, signal.SIGINT):
        count = len(rows(tmp_path)) + 5
        process = driver(tmp_path, "processes:2")
        wait_for(count, tmp_path, process)
        process.send_signal(ending)
        process.communicate(timeout=PATIENCE)  # ends when its processes have, which hold its pipes
        assert process.returncode and count <= len(rows(tmp_path)) < swept.POINTS
        logged = Counter(map(int, (tmp_path / "log").read_text().split()))
        kept = {number_of(p): logged[number_of(p)] for p, *_ in rows(tmp_path)} | kept
    counts = finish(tmp_path, "processes:2")
    assert all(counts[number] == count for number, count in kept.items())


class Cluster:
    """Dask's scheduler and workers, as real processes; a worker is one without a nanny."""

    def __init__(self, folder):
        self.file, self.parts = folder / f"{time.monotonic_ns()}.json", []
        self.scheduler = self.start("scheduler", "--port", "0", "--no-dashboard", "--no-show")
        self.workers = [self.worker() for _ in range(2)]

    def start(self, kind, *options):
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *options]
        command += ["--scheduler-file", self.file, "--host", "127.0.0.1"]
        with self.file.with_suffix(".log").open("a") as log:
            part = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log)
        self.parts.append(part)
        return part

    def worker(self):
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "60")
        return self.start("worker", *options)

    def end(self):
        for part in self.parts:
            part.kill()
            part.wait()


@pytest.fixture
def clusters(tmp_path):
    """A function that starts a cluster, which is gone at the end."""
    started = []

    def start():
        started.append(Cluster(tmp_path))
        end = time.monotonic() + PATIENCE
        while not started[-1].file.exists():
            assert time.monotonic() < end
            time.sleep(0.05)
        return started[-1]

    yield start
    for cluster in started:
        cluster.end()


@pytest.mark.slow
def test_dask_survives_kills_of_all_its_parts_and_a_full_disk(tmp_path, clusters):
    cluster = clusters()
    process = driver(tmp_path, f"dask:{cluster.file}")
    wait_for(5, tmp_path, process)
    os.kill(cluster.workers[0].pid, signal.SIGKILL)
    wait_for(15, tmp_path, process)
    cluster.worker()
    process.kill()
    process.communicate(timeout=PATIENCE)
    kept = set(rows(tmp_path))
    process = driver(tmp_path, f"dask:{cluster.file}")
    wait_for(len(kept) + 5, tmp_path, process)
    os.kill(cluster.scheduler.pid, signal.SIGKILL)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1 and "its workers are gone" in errors.splitlines()[-1], errors
    assert kept < set(rows(tmp_path)) and len(rows(tmp_path)) < swept.POINTS
    cluster.end()
    cluster = clusters()
    check_full(tmp_path, f"dask:{cluster.file}")
    finish(tmp_path, f"dask:{cluster.file}")

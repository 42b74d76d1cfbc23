"""The store of a sweep: each row once, whole, by one writer, also where parts are killed."""

import json
import os
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.bridges.sweeps.store import Row, Store
from serpentail.bridges.sweeps.sweep import posed
from tests.support import swept
from tests.support.rows import row

distributed = pytest.importorskip("distributed")

ROOT = Path(__file__).parents[3]
PATIENCE = 120  # s
FAILED = {*swept.HANGS, *swept.CRASHES, *swept.RAISES}
KEYS = np.arange(10, 300_010) * 2**40


def made(*numbers, failed=()):
    told = [(None, "wrong") if n in failed else (f'{{"y":{n}}}', None) for n in numbers]
    return [Row(n, *each, 0.5) for n, each in zip(numbers, told, strict=True)]


def numbers_of(store):
    store.look()
    return [row.number for row in store.rows()]


def test_rows_are_read_in_order_and_once_and_can_be_forgotten(tmp_path):
    for path in (None, tmp_path / "s"):
        store = Store(path, KEYS)
        with row(path), store.writing():
            for part in (made(7, 9, 250_000, failed=[9]), made(*range(7)), made(8, failed=[8])):
                store.accept(part)
            assert numbers_of(store) == [*range(10), 250_000] and store.failed.sum() == 2
            assert list(store.rows([9, 10])) == [Row(9, None, "wrong", 0.5)]
            assert np.flatnonzero(store.done).tolist() == numbers_of(store)
            store.forget()
            store.forget([3, 250_000])
            assert numbers_of(store) == [0, 1, 2, 4, 5, 6, 7] and store.failed.sum() == 0
    again = Store(path, KEYS[::-1])  # of another sweep, which shares the points
    assert numbers_of(again) == [299_999 - n for n in (7, 6, 5, 4, 2, 1, 0)]
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(st.SweepError, match="cannot be used"):
        numbers_of(Store(path, KEYS))


def test_one_process_writes_and_other_files_are_refused(tmp_path):
    first, second = (Store(tmp_path / "s", KEYS) for _ in range(2))
    with first.writing():
        with pytest.raises(st.SweepError, match="another process is writing"), second.writing():
            pass
        first.accept(made(1))
        second.look()
        assert numbers_of(second) == [1]  # who reads may
    with second.writing():
        pass
    (tmp_path / "old.txt").write_text("no rows" * 1000)
    with sqlite3.connect(tmp_path / "old.db") as old:
        old.execute("CREATE TABLE entries (number INTEGER)")
    old.close()
    for words, name in (
        ("not a database", "old.txt"),
        ("of another version", "old.db"),
        ("unable to open", "."),
    ):
        with row(words), pytest.raises(st.SweepError, match=words):
            Store(tmp_path / name, KEYS)


def driver(folder, executor, **settings):
    command = [sys.executable, "-m", "tests.support.swept", str(folder), executor, "0.1"]
    settings |= {"cwd": ROOT, "text": True, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(command, **settings)


def rows(folder):
    """Read the rows of the store: number, outcome, error."""
    numbers = {int(key): k for k, key in enumerate(posed(**swept.study(folder, 0.1)).posed.keys)}
    return [(numbers[key], *told) for key, *told in swept.stored(folder / "s.rows")]


def wait_for(count, folder, process):
    end = time.monotonic() + PATIENCE
    while len(rows(folder)) < count and process.poll() is None:
        assert time.monotonic() < end, process.args
        time.sleep(0.02)
    assert process.poll() is None, process.communicate()


def logged(folder):
    return Counter(map(int, (folder / "log").read_text().split()))


def finish(folder, executor):
    """Let a sweep go on to its end, and check that a further call runs nothing: every point has
    one row, and the outcomes are those of a closed form.
    """
    told = f"{swept.POINTS} of {swept.POINTS} points done, {len(FAILED)} of them failed, 0 left\n"
    printed, errors = driver(folder, executor).communicate(timeout=PATIENCE)
    assert printed == told, errors
    counts = logged(folder)
    assert driver(folder, executor).communicate(timeout=PATIENCE)[0] == told
    assert logged(folder) == counts
    found = {number: told for number, *told in rows(folder)}
    assert sorted(found) == list(range(swept.POINTS)) and len(rows(folder)) == swept.POINTS
    for number, (outcome, error) in found.items():
        assert (error is not None) == (number in FAILED), (number, error)
        wanted = {"twice": 2 * number, "text": swept.TEXT}
        assert (outcome and json.loads(outcome)) == (None if number in FAILED else wanted)
    assert all(found[n][1].startswith("TimeLimit") for n in swept.HANGS)
    assert all(found[n][1].startswith("ProcessEnded") for n in swept.CRASHES)
    return counts


@pytest.mark.slow
def test_a_full_disk_kills_and_ctrl_c_keep_the_rows(tmp_path):
    """On the same rows, one after the other: none is lost, and none that is there made again."""
    few = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (13_000, 13_000))  # bytes a file
    process = driver(tmp_path, "processes:2", preexec_fn=few)
    told = process.communicate(timeout=PATIENCE)[1].splitlines()[-1]
    assert process.returncode == 1 and "is not written" in told and "make room" in told
    assert 0 < len(rows(tmp_path)) < swept.POINTS
    kept = {}
    for ending in (signal.SIGKILL, signal.SIGKILL, signal.SIGINT):
        count = len(rows(tmp_path)) + 5
        process = driver(tmp_path, "processes:2")
        wait_for(count, tmp_path, process)
        process.send_signal(ending)
        process.communicate(timeout=PATIENCE)  # ends when its processes have, which hold its pipes
        assert process.returncode and count <= len(rows(tmp_path)) < swept.POINTS
        begun = logged(tmp_path)
        kept = {number: begun[number] for number, *_ in rows(tmp_path)} | kept
    counts = finish(tmp_path, "processes:2")
    assert all(counts[number] == count for number, count in kept.items())


@contextmanager
def cluster(folder):
    """Yield a cluster of Dask with two worker processes, and its name for a sweep."""
    given = {"processes": True, "dashboard_address": None}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **given) as dask:
        with dask.get_client() as client:
            client.write_scheduler_file(folder / "scheduler.json")
        yield dask, f"dask:{folder / 'scheduler.json'}"


@pytest.mark.slow
def test_dask_survives_kills_of_all_its_parts(tmp_path):
    with cluster(tmp_path) as (dask, name):
        process = driver(tmp_path, name)
        wait_for(5, tmp_path, process)
        os.kill(dask.workers[0].pid, signal.SIGKILL)
        wait_for(15, tmp_path, process)
        process.kill()
        process.communicate(timeout=PATIENCE)
        kept = set(rows(tmp_path))
        process = driver(tmp_path, name)
        wait_for(len(kept) + 5, tmp_path, process)
    _, errors = process.communicate(timeout=PATIENCE)  # the scheduler is gone
    assert process.returncode == 1 and "its workers are gone" in errors.splitlines()[-1], errors
    assert kept < set(rows(tmp_path)) and len(rows(tmp_path)) < swept.POINTS
    with cluster(tmp_path) as (_, name):
        finish(tmp_path, name)

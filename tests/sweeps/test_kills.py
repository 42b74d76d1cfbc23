"""The store of a sweep: each row once, whole, by one writer, also where parts are killed."""

import resource
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

import pytest

import serpentail as st
from serpentail.sweeps.store import Row, Store
from tests.support import swept
from tests.support.rows import row

ROOT = Path(__file__).parents[2]
PATIENCE = 120  # s
FAILED = {*swept.HANGS, *swept.CRASHES, *swept.RAISES}


ROW = Row("k", '{"x":1}', '{"y":2}', None, 0.5)


def test_a_row_that_is_there_stays_and_rows_are_written_all_or_none(tmp_path):
    store = Store(tmp_path / "s.db")
    with pytest.raises(st.NotWritten):
        store.add([ROW, Row("l", None, None, None, 0.1)])  # a row without a point
    assert store.known("kl") == {}
    store.add([ROW, Row("l", "{}", None, "wrong", 0.1)])
    store.add([ROW._replace(outcome='{"y":3}'), Row("m", "{}", "{}", None, 0.1)])
    assert store.rows(["k"]) == {"k": ROW}
    assert store.known(["k", "l", "n"]) == {"k": True, "l": False}
    store.close()
    with closing(Store(tmp_path / "s.db")) as again:
        assert set(again.rows("klmn")) == set("klm")
        again.forget(["l"])
        assert again.known("klm") == {"k": True, "m": True}
        again.add([ROW._replace(key=str(k)) for k in range(1203)])
        assert len(again.rows(map(str, range(1203)))) == 1203


def test_one_process_writes_and_other_files_are_refused(tmp_path):
    with closing(Store(tmp_path / "s.db")) as first, closing(Store(tmp_path / "s.db")) as second:
        with first.writing():
            with pytest.raises(st.SweepError, match="another process is writing"), second.writing():
                pass
            first.add([ROW])
            assert second.known("k") == {"k": True}  # who reads may
        with second.writing():
            pass
    (tmp_path / "text.db").write_text("no database at all, but a text of some length\n" * 50)
    with closing(sqlite3.connect(tmp_path / "other.db")) as other:
        other.execute("create table t (x)")
        other.commit()
    for words, name in (
        ("not a store", "text.db"),
        ("another program's", "other.db"),
        ("folder", "."),
    ):
        with row(words), pytest.raises(st.SweepError, match=words):
            Store(tmp_path / name)


def driver(folder, executor, **settings):
    return subprocess.Popen(
        [sys.executable, "-m", "tests.support.swept", str(folder), executor, "0.1"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **settings,
    )


def rows(folder):
    path = folder / "s.db"
    if not path.exists():
        return []
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True, timeout=10)) as base:
        try:
            return base.execute("select point, outcome, error from rows").fetchall()
        except sqlite3.OperationalError:  # it is being made
            return []


def wait_for(count, folder, process):
    end = time.monotonic() + PATIENCE
    while len(rows(folder)) < count and process.poll() is None:
        assert time.monotonic() < end, process.args
        time.sleep(0.02)
    assert process.poll() is None, process.communicate()


def number_of(point):
    return int(point.split(":")[1][:-1])


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
    found = {number_of(point): (outcome, error) for point, outcome, error in rows(folder)}
    assert sorted(found) == list(range(swept.POINTS)) and len(rows(folder)) == swept.POINTS
    for number, (outcome, error) in found.items():
        assert (error is not None) == (number in FAILED), (number, error)
        assert outcome == (None if number in FAILED else f'{{"twice": {2 * number}}}')
    assert all(found[n][1].startswith("TimeLimit") for n in swept.HANGS)
    assert all(found[n][1].startswith("ProcessEnded") for n in swept.CRASHES)
    with closing(sqlite3.connect(folder / "s.db")) as base:
        assert base.execute("pragma integrity_check").fetchone() == ("ok",)
    return counts


def check_full(folder, executor):
    """No file may grow beyond a few rows, as on a full disk."""
    few = (36_000, 36_000)
    limited = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, few)}
    process = driver(folder, executor, **limited)
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
        begun = logged(tmp_path)
        kept = {number_of(p): begun[number_of(p)] for p, *_ in rows(tmp_path)} | kept
    counts = finish(tmp_path, "processes:2")
    assert all(counts[number] == count for number, count in kept.items())


@contextmanager
def cluster(folder):
    """Yield the name of Dask's scheduler, the scheduler and workers, as real processes, and what
    starts a worker, one without a nanny.
    """
    file, parts = folder / f"{time.monotonic_ns()}.json", []

    def begin(kind, *options):
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *options]
        command += ["--scheduler-file", file, "--host", "127.0.0.1"]
        with file.with_suffix(".log").open("a") as log:
            parts.append(subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log))

    worker = partial(begin, "worker", "--nthreads", "1", "--no-nanny", "--death-timeout", "60")
    begin("scheduler", "--port", "0", "--no-show")
    try:
        worker()
        worker()
        end = time.monotonic() + PATIENCE
        while not file.exists():
            assert time.monotonic() < end
            time.sleep(0.05)
        yield f"dask:{file}", parts, worker
    finally:
        for part in parts:
            part.kill()
            part.wait()


@pytest.mark.slow
def test_dask_survives_kills_of_all_its_parts_and_a_full_disk(tmp_path):
    with cluster(tmp_path) as (name, parts, worker):
        process = driver(tmp_path, name)
        wait_for(5, tmp_path, process)
        parts[1].kill()  # a worker
        wait_for(15, tmp_path, process)
        worker()
        process.kill()
        process.communicate(timeout=PATIENCE)
        kept = set(rows(tmp_path))
        process = driver(tmp_path, name)
        wait_for(len(kept) + 5, tmp_path, process)
        parts[0].kill()  # the scheduler
        _, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1 and "its workers are gone" in errors.splitlines()[-1], errors
        assert kept < set(rows(tmp_path)) and len(rows(tmp_path)) < swept.POINTS
    with cluster(tmp_path) as (name, *_):
        check_full(tmp_path, name)
        finish(tmp_path, name)

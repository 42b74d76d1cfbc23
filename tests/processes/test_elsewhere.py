"""Children, pools, threads and other systems give the same; how many threads there are."""

import json
import math
import os
import pickle
import re
import subprocess
import sys

import pytest

import serpentail as st
from serpentail.compiling import threads as workers
from tests.support import zoo
from tests.support.rows import row

from .elsewhere import JOBS, MOMENTS, POOLS, TWICE, WAYS, start, starts

LIMIT = 500.0  # s
QUICK = ("fork", "beside rollouts")
BESIDE = [name for name in MOMENTS if name.startswith("beside")]  # where chance decides


@pytest.mark.parametrize(
    "ways", [QUICK, pytest.param([*WAYS, *10 * BESIDE], marks=pytest.mark.slow)]
)
def test_every_job_is_the_same_elsewhere(child, ways):
    zoo.model("m1_n3")  # compiled
    environment = os.environ | {"SERPENTAIL_THREADS": "2"}  # in workers of pools, too
    words = "-m", "tests.processes.elsewhere", zoo.folder("m1_n3"), *ways
    running = child(*words, env=environment)
    said, errors = running.communicate(timeout=LIMIT)
    assert running.returncode == 0, (said, errors)
    found = [json.loads(line) for line in said.splitlines()]
    same = [["same"] * (1 if way in MOMENTS else TWICE) for way in ways]
    assert found == [{way: dict.fromkeys(JOBS, each)} for way, each in zip(ways, same, strict=True)]


# How many threads a process uses.

V1, V2 = "4:cpu,cpuacct:{}\n0::/\n", "0::{}\n"


def v1(quota, period, at="cpu,cpuacct/"):
    """The files of the first version of control groups."""
    return {f"{at}cpu.cfs_quota_us": quota, f"{at}cpu.cfs_period_us": period}


POD = "cpu,cpuacct/pod/"
LIMITS = [
    ("2, its own", V2, "/pod/job", {"pod/job/cpu.max": "250000 100000\n"}, 2.5),
    ("2, a parent's", V2, "/pod/job", {"pod/job/cpu.max": "max 1\n", "pod/cpu.max": "3 2\n"}, 1.5),
    ("2, the least", V2, "/pod/job", {"pod/job/cpu.max": "5 10", "pod/cpu.max": "80 10"}, 0.5),
    ("2, a container's root", V2, "/", {"cpu.max": "300000 100000\n"}, 3.0),
    ("2, the host's path in a container", V2, "/docker/abc", {"cpu.max": "30 10\n"}, 3.0),
    ("2, none", V2, "/pod", {"pod/cpu.max": "max 100000\n"}, math.inf),
    ("2, no files", V2, "/pod", {}, math.inf),
    ("2, damaged", V2, "/pod", {"pod/cpu.max": "\x00 -3 many\n"}, math.inf),
    ("2, nothing granted", V2, "/pod", {"pod/cpu.max": "0 100000\n"}, math.inf),
    ("1, its own", V1, "/pod", v1("40000", "10000", POD), 4.0),
    ("1, a parent's", V1, "/pod/job", v1("-1\n", "9\n", f"{POD}job/") | v1("9\n", "2\n", POD), 4.5),
    ("1, mounted as cpu", V1, "/", v1("60000", "30000", "cpu/"), 2.0),
]


def test_quotas_of_control_groups_are_found(tmp_path):
    """In the root of a file system whose process is in a group."""
    for case, lines, group, files, expected in LIMITS:
        texts = {f"sys/fs/cgroup/{name}": text for name, text in files.items()}
        for name, text in (texts | {"proc/self/cgroup": lines.format(group)}).items():
            path = tmp_path / case / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        with row(case):
            assert workers.quota(tmp_path / case) == expected
    assert workers.quota(tmp_path) == math.inf


def test_an_argument_comes_before_the_environment_and_that_before_the_machine(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(6)), raising=False)
    monkeypatch.delenv("SERPENTAIL_THREADS", raising=False)
    for quota, expected in ((math.inf, 6), (0.2, 1), (9.0, 6), (2.1, 3)):
        monkeypatch.setattr(workers, "_quota_here", lambda quota=quota: quota)
        assert workers.threads() == expected, quota
    for chosen, expected in ((" 2 ", 2), ("", 3)):
        monkeypatch.setenv("SERPENTAIL_THREADS", chosen)
        assert (workers.threads(), workers.threads(4)) == (expected, 4)


def test_workers_of_process_pools_use_one_thread(monkeypatch):
    """Unless the environment says how many."""
    for ways, chosen, expected in ((("fork", "spawn", "loky"), "", 1), (("fork",), "3", 3)):
        monkeypatch.setenv("SERPENTAIL_THREADS", chosen)
        for way in ways:
            with row(way, chosen), POOLS[way](1) as pool:
                assert pool.submit(workers.threads).result(60) == expected
        assert workers.threads() == (expected if chosen else workers.cores())


def test_a_model_and_runs_keep_to_their_threads_and_digits(monkeypatch):
    crews, pool = [], workers.pool  # sizes of the pools that batches were shared among
    monkeypatch.setattr(workers, "pool", lambda size: crews.append(size) or pool(size))
    models = [st.load(zoo.folder("m1_n3"), threads=k) for k in (1, 2, 3)]
    q, v = starts(models[0], 5001)
    found = [model.forward_dynamics(q, v, [0.0, 0.0]) for model in models]
    assert crews == [2, 2, 3, 3, 3]
    assert found[0].tobytes() == found[1].tobytes() == found[2].tobytes()
    crews.clear()
    for twin in (pickle.loads(pickle.dumps(models[1])), models[1].with_parameters(tail_mass=0.01)):
        twin.mass_matrix(q)
    assert crews == [2, 2, 2, 2]
    runs = {"q0": q[:8], "v0": v[:8], "t_span": 0.01}
    found = [st.simulate(models[2], threads=k, **runs) for k in (None, 1, 2, 50)]
    assert [each.info["threads"] for each in found] == [3, 1, 2, 8]


def test_a_number_of_threads_that_is_none_is_refused(monkeypatch):
    model = zoo.model("m1_n3")
    q, v = starts(model, 2000)
    for value in (0, -1, 2.0, "4", True, 1025, [2]):
        words = rf"threads: value .*{re.escape(str(value))}.* 1 to 1024"
        with row(value):
            with pytest.raises(st.ModelError, match=words):
                st.load(model.folder, threads=value)
            with pytest.raises(st.SimulationError, match=words):
                st.simulate(model, q[:2], v[:2], threads=value)
    st.load(model.folder, threads=1024, compiled=False)
    for value in ("0", "-2", "many", "2.5", "1e2", "1025"):
        monkeypatch.setenv("SERPENTAIL_THREADS", value)
        with row(value), pytest.raises(st.SerpentailError, match=f"SERPENTAIL_THREADS.*{value}"):
            model.mass_matrix(q)
    with pytest.raises(st.SimulationError, match="threads: value 2"):
        st.simulate(model, *start(model), threads=2)


# This system takes the part of another one, from which these names are gone before serpentail is
# imported.
SYSTEMS = {
    "windows": """
import os, sys
import filelock, numpy  # which know by other signs where they are
filelock.FileLock = filelock.SoftFileLock
sys.modules |= dict.fromkeys(("fcntl", "resource"))
opened = os.open
os.open = lambda path, *more, **options: opened(f"{path}/none" if os.path.isdir(path) else path,
                                                *more, **options)
for name in ("geteuid", "killpg", "uname", "confstr", "register_at_fork", "sched_getaffinity",
             "O_CLOEXEC", "O_DIRECTORY", "O_NONBLOCK"):
    delattr(os, name)
os.supports_dir_fd.clear()
""",
    "macos": """
import os
del os.sched_getaffinity
""",
}
PROGRAM = """
import json, os, sys, time
from pathlib import Path
import serpentail as st
from serpentail.compiling import toolchain
from serpentail.compiling.cache_limit import contents, empty
from serpentail.compiling.cache import cache_folder
from serpentail.compiling.commands import run_all
from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for
told = {}

def stop():
    raise KeyboardInterrupt

folder, *places = sys.argv[1:]
for name in ("mass_matrix", "energy"):  # its folder is written, then replaced
    told["made"] = generate(scene_for("articulated", 1, 1, functions=[name]), cache_folder())[-1]
for _ in range(2):
    model = st.load(folder)
told["z"] = round(st.simulate(model, [0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8, t_span=0.1).q[-1, 2], 6)
held = contents(cache_folder())
empty(cache_folder())
told["cache"] = [held["libraries"], held["models"], contents(cache_folder())["libraries"]]
told["refused"] = []
for place in places:
    try:
        st.load(place)
    except st.ModelError as error:
        told["refused"].append("manifest.json" in str(error) and place in str(error))
begun = time.monotonic()
try:
    run_all([[sys.executable, "-c", "import time; time.sleep(60)"]], os.environ, stop)
except KeyboardInterrupt:
    told["ended"] = time.monotonic() - begun < 30
Path.read_text = lambda *_, **__: open("/no/such/file")
told["named"] = bool(toolchain.processor.__wrapped__())
print(json.dumps(told))
"""


def test_a_model_is_loaded_compiled_run_and_refused_and_a_command_is_ended(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    places = [tmp_path / name for name in ("none", "file", "empty")]
    expected = {"z": -0.049, "cache": [1, 1, 0], "refused": [True] * 3, "ended": True}
    for system, part in SYSTEMS.items():
        own = os.environ | {"SERPENTAIL_CACHE": str(tmp_path / system)}
        words = [sys.executable, "-W", "error", "-c", part + PROGRAM, zoo.folder("m1_n1"), *places]
        done = subprocess.run(words, env=own, capture_output=True, text=True, check=False)
        with row(system):
            assert (done.returncode, done.stderr) == (0, "")
            assert json.loads(done.stdout) == expected | {"named": True, "made": "manifest.json"}

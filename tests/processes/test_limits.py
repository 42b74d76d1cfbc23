"""How many threads a process uses: as asked, as the environment says, as machine and container
allow.
"""

import json
import math
import os
import pickle
import re
import subprocess
import sys

import numpy as np
import pytest

import serpentail as st
from serpentail.model import cores, workers
from tests.support import zoo
from tests.support.rows import row

from .jobs import start

V1, V2 = "4:cpu,cpuacct:{}\n0::/\n", "0::{}\n"


def tree(root, group, files, lines):
    """A root of a file system with control groups, of which the process is in one."""
    (root / "proc/self").mkdir(parents=True)
    (root / "proc/self/cgroup").write_text(lines.format(group))
    for name, text in files.items():
        path = root / "sys/fs/cgroup" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


CPU = "cpu,cpuacct"
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
    (
        *("1, its own", V1, "/job"),
        {f"{CPU}/job/cpu.cfs_quota_us": "40000", f"{CPU}/job/cpu.cfs_period_us": "10000"},
        4.0,
    ),
    (
        *("1, a parent's", V1, "/pod/job"),
        {
            f"{CPU}/pod/job/cpu.cfs_quota_us": "-1\n",
            f"{CPU}/pod/job/cpu.cfs_period_us": "100000\n",
            f"{CPU}/pod/cpu.cfs_quota_us": "450000\n",
            f"{CPU}/pod/cpu.cfs_period_us": "100000\n",
        },
        4.5,
    ),
    (
        *("1, mounted as cpu", V1, "/"),
        {"cpu/cpu.cfs_quota_us": "60000", "cpu/cpu.cfs_period_us": "30000"},
        2.0,
    ),
]


def test_quotas_of_control_groups_are_found(tmp_path):
    for case, lines, group, files, expected in LIMITS:
        with row(case):
            assert cores.quota(tree(tmp_path / case, group, files, lines)) == expected
    assert cores.quota(tmp_path) == math.inf


def test_cores_are_those_of_affinity_and_quota(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(6)), raising=False)
    monkeypatch.delenv("SERPENTAIL_THREADS", raising=False)
    for quota, expected in ((math.inf, 6), (2.1, 3), (0.2, 1), (9.0, 6)):
        monkeypatch.setattr(cores, "_own_quota", lambda quota=quota: quota)
        assert cores.threads() == expected, quota


def test_an_argument_comes_before_the_environment_and_that_before_the_machine(monkeypatch):
    monkeypatch.setattr(cores, "cores", lambda: 5)
    monkeypatch.delenv("SERPENTAIL_THREADS", raising=False)
    assert (cores.threads(), cores.threads(3)) == (5, 3)
    monkeypatch.setenv("SERPENTAIL_THREADS", " 2 ")
    assert (cores.threads(), cores.threads(3)) == (2, 3)
    monkeypatch.setenv("SERPENTAIL_THREADS", "")
    assert cores.threads() == 5


WORKERS = """
import json, multiprocessing, sys
from concurrent.futures import ProcessPoolExecutor
import joblib
from serpentail.model.cores import threads
if __name__ == "__main__":
    found = [threads()]
    with multiprocessing.get_context("fork").Pool(1) as pool:
        found.append(pool.apply(threads))
    if sys.argv[1:]:
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            found.append(pool.submit(threads).result(60))
        found += joblib.Parallel(2, timeout=60)([joblib.delayed(threads)()])
    print(json.dumps(found))
"""


def test_workers_of_process_pools_use_one_thread():
    """Unless the environment says how many."""
    for chosen, more, expected in (("", ["spawn"], [cores.cores(), 1, 1, 1]), ("3", [], [3, 3])):
        command = [sys.executable, "-c", WORKERS, *more]
        environment = os.environ | {"SERPENTAIL_THREADS": chosen}
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=100, check=True
        )
        assert json.loads(done.stdout) == expected


# What is asked for is used, and changes no digit.


@pytest.fixture
def crews(monkeypatch):
    """Sizes of the pools that batches were shared among."""
    found, pool = [], workers.pool
    monkeypatch.setattr(workers, "pool", lambda size: found.append(size) or pool(size))
    return found


def _states(model, count):
    random = np.random.default_rng(3)
    return [each + 1e-3 * random.normal(size=(count, len(each))) for each in start(model)]


def test_a_model_keeps_to_its_threads_and_digits(crews):
    models = [st.load(zoo.folder("m1_n3"), threads=k) for k in (1, 2, 3)]
    q, v = _states(models[0], 5001)
    found = [model.forward_dynamics(q, v, [0.0, 0.0]) for model in models]
    assert crews == [2, 2, 3, 3, 3]
    assert found[0].tobytes() == found[1].tobytes() == found[2].tobytes()
    crews.clear()
    for twin in (pickle.loads(pickle.dumps(models[1])), models[1].with_parameters(tail_mass=0.01)):
        twin.mass_matrix(q)
    assert crews == [2, 2, 2, 2]


def test_runs_keep_to_their_threads_and_digits():
    model = st.load(zoo.folder("m1_n3"), threads=3)
    q, v = _states(model, 8)
    settings = {"t_span": 0.05, "output_step": 0.01}
    found = [st.simulate(model, q, v, threads=k, **settings) for k in (None, 1, 2, 50)]
    assert [each.info["threads"] for each in found] == [3, 1, 2, 8]
    assert len({each.q.tobytes() + each.kinetic.tobytes() for each in found}) == 1


def test_a_number_of_threads_that_is_none_is_refused(monkeypatch):
    model = zoo.model("m1_n3")
    q, v = _states(model, 2000)
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

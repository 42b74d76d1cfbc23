"""Models load, compile, run and end without what only POSIX has; this system takes the part of
another one, from which these names are gone before serpentail is imported.
"""

import os
import subprocess
import sys

import pytest

from tests.support.models import model_folder

WINDOWS = """
import os
import filelock, numpy  # which know by other signs where they are
filelock.FileLock = filelock.SoftFileLock
for name in ("geteuid", "killpg", "uname", "confstr", "register_at_fork", "sched_getaffinity",
             "O_CLOEXEC", "O_DIRECTORY", "O_NONBLOCK"):
    delattr(os, name)
os.supports_dir_fd.clear()
"""
MACOS = """
import os
del os.sched_getaffinity
"""
systems = pytest.mark.parametrize("system", [WINDOWS, MACOS], ids=["windows", "macos"])


@pytest.fixture
def printed(tmp_path):
    """Return a function from a system's part, a program and its arguments to what it prints."""

    def run(system, program, *arguments):
        own = os.environ | {"SERPENTAIL_CACHE": str(tmp_path / "cache")}
        command = [sys.executable, "-W", "error", "-c", system + program, *map(str, arguments)]
        done = subprocess.run(command, env=own, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout

    return run


@systems
def test_a_model_is_loaded_compiled_and_run(printed, system):
    program = """
import sys, serpentail as st
from serpentail.model.bound import contents, empty
from serpentail.model.cache import cache_folder
for _ in range(2):
    model = st.load(sys.argv[1])
flight = st.simulate(model, [0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8, t_span=0.1)
print(round(flight.q[-1, 2], 6))
held = contents(cache_folder(None))
print(held["libraries"], held["models"])
empty(cache_folder(None))
print(contents(cache_folder(None))["libraries"])
"""
    folder = model_folder(1, 1, functions=["energy", "momentum", "rollout"])
    assert printed(system, program, folder).split() == ["-0.049", "1", "1", "0"]


@systems
def test_a_changed_or_missing_folder_is_refused(printed, system, tmp_path):
    program = """
import sys, serpentail as st
for place in sys.argv[1:]:
    try:
        st.load(place)
    except st.ModelError as error:
        print(str(error).partition(":")[0].replace(place, "FOLDER"))
"""
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    places = [tmp_path / name for name in ("none", "file", "empty")]
    expected = ["FOLDER is not a generated folder (it has no manifest.json)"] * 3
    assert printed(system, program, *places).splitlines() == expected


@systems
def test_a_command_is_ended(printed, system):
    program = """
import os, sys, time
from serpentail.model.commands import run_all
def stop():
    raise KeyboardInterrupt
start = time.monotonic()
try:
    run_all([[sys.executable, "-c", "import time; time.sleep(60)"]], os.environ, stop)
except KeyboardInterrupt:
    print(time.monotonic() - start < 30)
"""
    assert printed(system, program) == "True\n"


@systems
def test_the_processor_has_a_name(printed, system):
    program = """
from pathlib import Path
from serpentail.model import toolchain
Path.read_text = lambda *_, **__: open("/no/such/file")
print(bool(toolchain._processor()))
"""
    assert printed(system, program) == "True\n"

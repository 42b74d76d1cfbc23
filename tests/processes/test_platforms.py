"""Models load, compile, run and end without what only POSIX has; this system takes the part of
another one, from which these names are gone before serpentail is imported.
"""

import json
import os
import subprocess
import sys

from tests.support import zoo
from tests.support.rows import row

SYSTEMS = {
    "windows": """
import os
import filelock, numpy  # which know by other signs where they are
filelock.FileLock = filelock.SoftFileLock
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
from serpentail.model import toolchain
from serpentail.model.bound import contents, empty
from serpentail.model.cache import cache_folder
from serpentail.model.commands import run_all
told = {}

def stop():
    raise KeyboardInterrupt

folder, *places = sys.argv[1:]
for _ in range(2):
    model = st.load(folder)
told["z"] = round(st.simulate(model, [0, 0, 0, 1, 0, 0, 0, 0, 0], [0] * 8, t_span=0.1).q[-1, 2], 6)
held = contents(cache_folder(None))
empty(cache_folder(None))
told["cache"] = [held["libraries"], held["models"], contents(cache_folder(None))["libraries"]]
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
told["named"] = bool(toolchain._processor())
print(json.dumps(told))
"""


def test_a_model_is_loaded_compiled_run_and_refused_and_a_command_is_ended(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    places = [tmp_path / name for name in ("none", "file", "empty")]
    for system, part in SYSTEMS.items():
        own = os.environ | {"SERPENTAIL_CACHE": str(tmp_path / system)}
        command = [
            sys.executable,
            "-W",
            "error",
            "-c",
            part + PROGRAM,
            zoo.folder("m1_n1"),
            *places,
        ]
        done = subprocess.run(command, env=own, capture_output=True, text=True, check=False)
        with row(system):
            assert (done.returncode, done.stderr) == (0, "")
            told = json.loads(done.stdout)
            assert told == {"z": -0.049, "cache": [1, 1, 0]} | {
                "refused": [True] * 3,
                "ended": True,
                "named": True,
            }

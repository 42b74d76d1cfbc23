"""C3D files, which a process of its own reads."""

import subprocess
import sys

import numpy as np
import pytest

import serpentail as st
from serpentail.identification import c3d as reading
from tests.identification.test_files import NAMES, STEP, some
from tests.support.rows import row


def c3d(tracks, path, first=0):
    """Write tracks as ezc3d does."""
    ezc3d = pytest.importorskip("ezc3d")
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"], point["UNITS"]["value"] = [200], ["mm"]
    point["LABELS"]["value"] = list(tracks.names)
    points = np.ones((4, *tracks.positions.shape[1::-1]))
    points[:3] = np.moveaxis(1e3 * tracks.positions, [0, 1, 2], [2, 1, 0])
    file["data"]["points"], file["header"]["points"]["first_frame"] = points, first
    file.write(str(path))
    return path


def test_c3d_is_read_as_ezc3d_writes_it(tmp_path):
    """Also from a frame that is not the first."""
    tracks = some()
    for first in (0, 9):
        found = st.read_markers(c3d(tracks, tmp_path / "run.c3d", first))
        assert found.names == tracks.names
        np.testing.assert_allclose(found.times, STEP * (first + np.arange(6)), rtol=1e-9)
        np.testing.assert_allclose(found.positions, tracks.positions, atol=1e-6)
    with pytest.raises(st.IdentificationError, match="unit: value 'm': the file states mm"):
        st.read_markers(tmp_path / "run.c3d", "m")


def test_no_c3d_file_ends_this_process(tmp_path, monkeypatch):
    """One byte of the names' size is damaged: ezc3d ends by a signal. Limits end it, too."""
    path = c3d(some(), tmp_path / "run.c3d")
    whole = path.read_bytes()
    long = st.marker_tracks(np.arange(2e4), np.ones((20_000, 2, 3)), NAMES, unit="m")
    large = c3d(long, path).read_bytes()
    place = whole.index(b"LABELS") + 9
    rows = (
        ("SIGSEGV", {}, whole[:place] + b"\xff" + whole[place + 1 :]),
        ("c3d file", {}, b"\x00\xff" * 300),
        ("MemoryError|bad_alloc|SIG", {"MEMORY": (2**20, 0)}, large),
        ("no answer in 0.003 s", {"WAIT": 1e-3}, whole),
    )
    for words, limits, content in rows:
        path.write_bytes(content)
        with row(words), monkeypatch.context() as patches:
            for name, value in limits.items():
                patches.setattr(reading, name, value)
            with pytest.raises(st.IdentificationError, match=f"^[^\n]*run.c3d: .*({words}).*CSV$"):
                st.read_markers(path)


SCRIPT = """import os, sys, threading
import serpentail as st
print("begun", flush=True)
def read():
    assert st.read_markers(sys.argv[1]).names == ("nose", "tip")
    print("read", flush=True)
thread = threading.Thread(target=read)
thread.start(), thread.join()
child = os.fork()
if child == 0:
    read(), os._exit(0)
assert os.waitpid(child, 0)[1] == 0 and "ezc3d" not in sys.modules
"""


def test_c3d_is_read_from_threads_forks_and_programs_without_a_file(tmp_path):
    path = str(c3d(some(), tmp_path / "run.c3d"))
    done = subprocess.run(
        [sys.executable, "-", path], input=SCRIPT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["begun", "read", "read"]

"""FMUs at their limits: what cannot be one, calls that are refused, sources and symbols."""

import ctypes
import re
import subprocess
import zipfile
from xml.etree import ElementTree as Xml

import pytest

import serpentail as st
from serpentail.exporting.fmu import NATIVE
from tests.support import zoo
from tests.support.models import model_folder
from tests.support.rows import row

DISCARD, ERROR = 2, 3
FLYING = ["forward_dynamics", "forward_dynamics_derivatives", "rollout"]


def test_what_no_fmu_can_be_of(tmp_path):
    # no model of the zoo lacks C
    casadi = st.load(model_folder(1, 1, functions=FLYING, targets=["casadi"]), compiled=False)
    for model, error, words in (
        (zoo.model("fixed"), st.ExportError, "base: value 'fixed' of fixed"),
        (zoo.model("polar"), st.ExportError, "coordinates: value 'polar' of polar.*bend"),
        (zoo.model("single"), st.ExportError, "real: value 'float' of single.*double"),
        (zoo.model("bare"), st.ModelError, "'forward_dynamics_derivatives'.*'rollout'.*functions"),
        (casadi, st.ModelError, '"c".*targets'),
    ):
        with row(model.name), pytest.raises(error, match=words):
            st.export(model, "fmu", tmp_path / "x.fmu")
    assert list(tmp_path.iterdir()) == []


def status_of(call, *arguments):
    """The status that a call is refused with."""
    with pytest.raises(Exception, match="status") as refused:
        call(*arguments)
    return refused.value.status


def test_calls_that_make_no_sense_are_refused_and_told(fmu, opened):
    with pytest.raises(Exception, match="Failed to instantiate"):
        opened(fmu("m1_n1"), "Model", guid="0")
    one, _, told = opened(fmu("m1_n1"), "Model")
    for call, *arguments in (
        (one.getReal, [10**6]),
        (one.setReal, [20], [0.0]),
        (one.setReal, [10**6], [0.0]),
        (one.getInteger, [0]),
        (one.setBoolean, [0], [1]),
        (one.getDirectionalDerivative, [17], [10**6], [1.0]),
        (one.getDirectionalDerivative, [10**6], [0], [1.0]),
        (one.getDirectionalDerivative, [17], [20], [1.0]),
    ):
        with row(call.__name__, *arguments):
            told.clear()
            assert status_of(call, *arguments) == ERROR
            assert "needs" in told[0] or "Real" in told[0]
    # a state without accelerations is discarded
    told.clear()
    one.setReal([3, 4, 5, 6], [0.0, 0.0, 0.0, 0.0])
    assert status_of(one.getReal, [30]) == DISCARD
    assert "no accelerations" in told[0]
    status_of(one.getDirectionalDerivative, [20], [0], [1.0])
    one.setReal([3], [1.0])
    assert one.getReal([28]) == pytest.approx([-9.8], rel=1e-12)


def test_a_step_that_cannot_be_made_leaves_the_state(fmu, opened):
    one, _, told = opened(fmu("m1_n1"), "Slave")
    references = list(range(17))
    before = one.getReal(references)
    one.setReal([34], [1e300])
    for step in (0.1, 0.0, -1.0, float("nan")):
        assert status_of(one.doStep, 0.0, step) == ERROR
    assert "the motion cannot go on" in told[0] and "communicationStepSize" in told[1]
    assert one.getReal(references) == before
    one.setReal([34], [0.0])
    one.doStep(0.0, 0.25)
    last = ctypes.c_double()
    one.fmi2GetRealStatus(one.component, 2, ctypes.byref(last))
    assert last.value == 0.25


def shown(library):
    """The functions that a library shows."""
    command = ["nm", "-D", "--defined-only", str(library)]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return set(re.findall(r" T (\w+)", listed))


def test_libraries_show_the_interface_alone_and_sources_compile_without_a_warning(fmu, tmp_path):
    """Several units in one process share no function; with a prefix the names have it."""
    fmi2 = pytest.importorskip("fmpy.fmi2")
    with zipfile.ZipFile(fmu("ground_m1_n1")) as archive:
        archive.extractall(tmp_path)
    own = shown(tmp_path / "binaries" / "linux64" / "ground_m1_n1.so")
    assert len(own) == 44 and all(name.startswith("fmi2") for name in own)
    asked = dir(fmi2.FMU2Model) + dir(fmi2.FMU2Slave)
    assert {name for name in asked if name.startswith("fmi2")} <= own
    sources = sorted((tmp_path / "sources").glob("*.c"))
    described = Xml.parse(tmp_path / "modelDescription.xml")
    for kind in ("ModelExchange", "CoSimulation"):
        files = described.findall(f"{kind}/SourceFiles/File")
        assert {each.get("name") for each in files} == {path.name for path in sources}
    assert all("-" in path.name for path in NATIVE.iterdir())  # as in no model's name
    library = tmp_path / "unit.so"
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    options = ["-fvisibility=hidden", "-DFMI2_FUNCTION_PREFIX=rat_", "-o", library, "-lm"]
    command = list(map(str, ["cc", *strict, *sources, *options]))
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert shown(library) == {f"rat_{name}" for name in own}
    read = ctypes.CDLL(str(library))
    read.rat_fmi2GetVersion.restype = ctypes.c_char_p
    assert read.rat_fmi2GetVersion() == b"2.0"

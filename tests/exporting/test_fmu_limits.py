"""FMUs at their limits: what cannot be one, calls that are refused, sources and symbols."""

import ctypes
import re
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as Xml

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave

import serpentail as st
from serpentail_codegen.scene.parse import scene_for
from tests.exporting.sources import compiled
from tests.support.models import folder_of, model_folder

FUNCTIONS = ["forward_dynamics", "forward_dynamics_derivatives", "rollout"]
DISCARD, ERROR = 2, 3


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    model = st.load(model_folder(1, 2, functions=FUNCTIONS))
    return st.export(model, "fmu", tmp_path_factory.mktemp("fmu") / "rat.fmu")


@pytest.fixture(scope="module")
def unzipped(path, tmp_path_factory):
    return fmpy.extract(str(path), str(tmp_path_factory.mktemp("unzipped")))


@pytest.fixture
def unit(path, unzipped):
    """Return a unit of a kind by its interface, as made, and what it tells."""
    guid = fmpy.read_model_description(str(path)).guid

    def made(kind, guid=guid):
        told = []
        found = kind(
            guid=guid,
            unzipDirectory=unzipped,
            modelIdentifier="articulated_m1_n2",
            instanceName="rat",
        )
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
            lambda _, name, status, category, message: told.append(message.decode())
        )
        callbacks.logger = logger
        callbacks.allocateMemory = fmpy.fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmpy.fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        found.instantiate(callbacks=callbacks)
        found.kept = logger, callbacks
        return found, told

    return made


@pytest.mark.parametrize(
    ("size", "options", "words"),
    [
        ((1, None), {"coordinates": "polar"}, "coordinates: value 'polar' of .* give \"bend\" to"),
        ((1, 2), {"real": "float"}, "real: value 'float' of .* give \"double\" to the scene"),
    ],
)
def test_what_no_fmu_can_be_of(size, options, words, tmp_path):
    model = st.load(model_folder(*size, **options), compiled=False)
    with pytest.raises(st.ExportError, match=words):
        st.export(model, "fmu", tmp_path / "x.fmu")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("absent", FUNCTIONS)
def test_a_function_that_it_needs(absent, tmp_path):
    has = ["energy"] if absent == "forward_dynamics" else [f for f in FUNCTIONS if f != absent]
    model = st.load(model_folder(1, 2, functions=has), compiled=False)
    with pytest.raises(st.ModelError, match=rf"without .*'{absent}'.*add it to `functions`"):
        st.export(model, "fmu", tmp_path / "x.fmu")


def test_a_model_without_c(tmp_path):
    model = st.load(model_folder(1, 2, targets=["casadi"]), compiled=False)
    with pytest.raises(st.ModelError, match=r'add "c" to `targets`'):
        st.export(model, "fmu", tmp_path / "x.fmu")


def test_baked_parameters_are_no_variables(tmp_path):
    model = st.load(model_folder(1, 2, functions=FUNCTIONS, baked=True))
    path = st.export(model, "fmu", tmp_path / "x.fmu")
    described = fmpy.read_model_description(str(path))
    assert not [each for each in described.modelVariables if each.causality == "parameter"]
    rows = fmpy.simulate_fmu(str(path), stop_time=0.1, output_interval=0.1, output=["v[3]"])
    assert rows["v[3]"][-1] == pytest.approx(-0.98, rel=1e-9)


@pytest.mark.parametrize("name", ["model", "fmu", "unit"])
def test_no_name_of_a_model_is_that_of_a_source(name, tmp_path):
    scene = replace(scene_for("articulated", 1, 2, functions=FUNCTIONS), name=name)
    model = st.load(folder_of(scene))
    rows = fmpy.simulate_fmu(
        str(st.export(model, "fmu", tmp_path / "x.fmu")), stop_time=0.1, output=["v[3]"]
    )
    assert rows["v[3]"][-1] == pytest.approx(-0.98, rel=1e-9)


def test_another_guid_is_refused(unit):
    with pytest.raises(Exception, match="Failed to instantiate"):
        unit(FMU2Model, guid="0")


def test_a_state_without_accelerations_is_discarded_and_told(unit):
    one, told = unit(FMU2Model)
    one.setReal([3, 4, 5, 6], [0.0, 0.0, 0.0, 0.0])
    with pytest.raises(FMICallException) as refused:
        one.getReal([30])
    assert refused.value.status == DISCARD
    assert "no accelerations" in told[0]
    with pytest.raises(FMICallException):
        one.getDirectionalDerivative([20], [0], [1.0])
    one.setReal([3], [1.0])
    assert one.getReal([28]) == pytest.approx([-9.8], rel=1e-12)
    one.freeInstance()


@pytest.mark.parametrize(
    "call",
    [
        lambda one: one.getReal([10**6]),
        lambda one: one.setReal([20], [0.0]),
        lambda one: one.setReal([10**6], [0.0]),
        lambda one: one.getInteger([0]),
        lambda one: one.setBoolean([0], [1]),
        lambda one: one.getDirectionalDerivative([17], [10**6], [1.0]),
        lambda one: one.getDirectionalDerivative([10**6], [0], [1.0]),
        lambda one: one.getDirectionalDerivative([17], [20], [1.0]),
    ],
)
def test_wrong_references_are_refused_and_told(unit, call):
    one, told = unit(FMU2Model)
    with pytest.raises(FMICallException) as refused:
        call(one)
    assert refused.value.status == ERROR
    assert "needs" in told[0] or "Real" in told[0]
    one.freeInstance()


def test_a_step_that_cannot_be_made_leaves_the_state(unit):
    one, told = unit(FMU2Slave)
    references = list(range(17))
    before = one.getReal(references)
    one.setReal([34], [1e300])
    for step in (0.1, 0.0, -1.0, float("nan")):
        with pytest.raises(FMICallException) as refused:
            one.doStep(0.0, step)
        assert refused.value.status == ERROR
    assert "the motion cannot go on" in told[0] and "communicationStepSize" in told[1]
    assert one.getReal(references) == before
    one.setReal([34], [0.0])
    one.doStep(0.0, 0.25)
    last = ctypes.c_double()
    one.fmi2GetRealStatus(one.component, 2, ctypes.byref(last))
    assert last.value == 0.25
    one.freeInstance()


def test_sources_compile_without_a_warning_also_with_a_prefix(unzipped, tmp_path):
    library = ctypes.CDLL(str(compiled(unzipped, tmp_path, "-DFMI2_FUNCTION_PREFIX=rat_")))
    library.rat_fmi2GetVersion.restype = ctypes.c_char_p
    assert library.rat_fmi2GetVersion() == b"2.0"


def test_the_library_shows_the_interface_alone(unzipped, tmp_path):
    """Several units in one process share no function; those of the standard are all there."""
    for library in (
        compiled(unzipped, tmp_path),
        f"{unzipped}/binaries/linux64/articulated_m1_n2.so",
    ):
        listed = subprocess.run(
            ["nm", "-D", "--defined-only", str(library)], capture_output=True, text=True, check=True
        ).stdout
        shown = set(re.findall(r" T (\w+)", listed))
        asked = {name for name in dir(FMU2Model) + dir(FMU2Slave) if name.startswith("fmi2")}
        assert shown and all(name.startswith("fmi2") for name in shown)
        assert len(shown) == 44 and asked <= shown


def test_the_description_names_all_that_is_compiled(path):
    with zipfile.ZipFile(path) as archive:
        there = {Path(name).name for name in archive.namelist() if name.endswith(".c")}
        described = Xml.fromstring(archive.read("modelDescription.xml"))
    for kind in ("ModelExchange", "CoSimulation"):
        files = described.findall(f"{kind}/SourceFiles/File")
        assert {each.get("name") for each in files} == there

"""Units (FMUs) of the zoo's models, made once, and opened."""

from functools import cache

import pytest

import serpentail as st
from tests.support import zoo


@pytest.fixture(scope="session")
def fmu(tmp_path_factory):
    """Return a function from the name of a model to the path of its unit."""
    folder = tmp_path_factory.mktemp("units")
    return cache(lambda name: st.export(zoo.model(name), "fmu", folder / f"{name}.fmu"))


@pytest.fixture
def opened(tmp_path):
    """Return a function from a path and a kind of interface to an initialised unit, the references
    of its variables, and a list of what it tells.
    """
    fmi2 = pytest.importorskip("fmpy.fmi2")
    import fmpy

    units = []

    def made(path, kind, guid=None):
        described, told = fmpy.read_model_description(str(path)), []
        folder = tmp_path / path.stem
        if not folder.exists():
            fmpy.extract(str(path), str(folder))
        found = getattr(fmi2, f"FMU2{kind}")(
            guid=guid or described.guid,
            unzipDirectory=str(folder),
            modelIdentifier=described.modelExchange.modelIdentifier,
            instanceName="rat",
        )
        callbacks = fmi2.fmi2CallbackFunctions()
        tell = fmi2.fmi2CallbackLoggerTYPE(lambda *words: told.append(words[-1].decode()))
        callbacks.logger = tell
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        found.instantiate(callbacks=callbacks)
        units.append((found, callbacks, tell))
        found.setupExperiment(startTime=0.0)
        found.enterInitializationMode()
        found.exitInitializationMode()
        return found, {each.name: each.valueReference for each in described.modelVariables}, told

    yield made
    for each, *_ in units:
        each.terminate()
        each.freeInstance()

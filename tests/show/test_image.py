"""The memory of a run that a page computes: its records, with addresses of their own."""

import ctypes
import struct
from functools import partial, reduce

import numpy as np

import serpentail as st
from serpentail.motion.derived import AGAIN
from serpentail.show.computing.image import BASE, WRITTEN, Image
from serpentail.simulation.runs.single import CompiledRun
from tests.support import zoo

FORMS = {"pointer": "<I", "real": "<d", "int": "<i", "long": "<i"}


def behind(image, place, thing):
    """Return the end of what lies at a place, which is this thing; pointers lead to their own."""
    if isinstance(thing, np.ndarray):
        assert image.bytes[place - BASE :][: thing.nbytes] == thing.tobytes()
        return place + thing.nbytes
    if isinstance(thing, ctypes.Array):
        return reduce(partial(behind, image), thing, place)
    for member, kind in image.members[image.names[type(thing)]]:
        told, size = getattr(thing, member), struct.calcsize(FORMS[kind])
        place += -place % size + size
        (found,) = struct.unpack_from(FORMS[kind], image.bytes, place - size - BASE)
        if kind != "pointer" or not told:
            assert found == (told or 0), member
        elif member not in WRITTEN:
            behind(image, found, image.found[told])
    return place + -place % 8


def test_an_image_holds_the_records_and_all_that_they_lead_to():
    model, flight = zoo.model("ground_m2_n2"), {"t_span": 0.01, "legs": st.Legs.fixed(3, -1)}
    torques = st.TorqueTable([0, 0.01], 1e-6 * np.arange(8.0).reshape(2, 4), damping=1e-3)
    run = st.simulate(model, model.state(position=[0, 0, 1]), controller=torques, **flight)
    again = vars(run)[AGAIN]
    run = CompiledRun(again.runs(again.start, again.ground, again.method))
    arrays = [run.runs.parameters.vectors, *run.runs.state.values(), *run.runs.out.values()]
    image = Image(run.runs.records, [*arrays, run.runs.peaks])
    place = image.put(image.translated(run.record))
    assert behind(image, place, run.record) == BASE + len(image.bytes)

"""The memory of a run that a page computes: its records, with addresses of their own."""

import ctypes
import struct
from functools import partial, reduce

import numpy as np
import pytest

import serpentail as st
from serpentail.show.computing import again
from serpentail.show.computing.image import BASE, WRITTEN, Image
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


def test_an_image_holds_the_records_and_all_that_they_lead_to(monkeypatch):
    model, images, legs = zoo.model("ground_m2_n2"), [], st.Legs.fixed(3, -1)
    torques = st.TorqueTable([0, 0.01], 1e-6 * np.arange(8.0).reshape(2, 4), damping=1e-3)
    law = st.Pfl(model, ([0.0, 0.1], np.tile([0.4, 0.5], (2, 2))), kp=3e4, kd=300)
    how = {"controller": st.Phases([(0, torques), (0.005, law)]), "output_step": 1e-3}
    start = model.state(height=1, roll=20, spin=[1, 2, 3], bend=[5, 9, 2, 4])
    run = st.simulate(model, start, t_span=0.01, legs=legs, **how)
    monkeypatch.setattr(again, "webassembly", lambda *_: b"")
    monkeypatch.setattr(again, "Image", lambda *of: images.append(Image(*of)) or images[0])
    told, (image,) = again.computed_again(model, run, 100), images
    (record,) = [each for each in image.found.values() if type(each).__name__ == "run"]
    assert behind(image, told["run"], record) <= BASE + len(image.bytes)
    for knob in told["knobs"]:
        for place in knob["places"]:
            (found,) = struct.unpack_from("<d", image.bytes, place - BASE)
            assert found == pytest.approx(knob["scale"] * knob["value"], abs=1e-10), knob["name"]
    assert {"kp of phase 2", "damping of phase 1"} <= {knob["name"] for knob in told["knobs"]}

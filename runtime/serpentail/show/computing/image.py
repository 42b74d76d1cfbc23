"""The memory of a run in WebAssembly: its C records and arrays, with addresses of 32 bits."""

import ctypes
from typing import Any

import numpy as np

from ...model.memory import address_of
from ...simulation.records import OF_MEMORY, Records

BASE = 2**21  # address of the image, above the stack and the constants of a module
KINDS: dict[str, Any] = {
    "pointer": ctypes.c_uint32,
    **dict.fromkeys(("int", "long"), ctypes.c_int32),
    "real": ctypes.c_double,
}
WRITTEN = ("work", "event_times", "event_kinds")  # by C, before anybody reads them


class Image:
    """Bytes, to be copied to the address ``BASE``, of records and of all that they point to.

    arrays: what records point to besides what they keep.
    """

    def __init__(self, records: Records, arrays: list[np.ndarray]):
        self.bytes = bytearray()
        self.places: dict[int, int] = {}  # address in this process -> address in the image
        self.members = records.code.manifest["simulation"]["records"]
        self.names = {kind: name for name, kind in records.types.items()}
        self.types: dict[str, Any] = {}
        for name, members in self.members.items():
            fields = [(member, KINDS[kind]) for member, kind in members]
            self.types[name] = type(name, (ctypes.LittleEndianStructure,), {"_fields_": fields})
        memory = [each for each in records.kept if isinstance(each, OF_MEMORY)]
        self.found: dict[int, Any] = {ctypes.addressof(each): each for each in memory}
        arrays = [*arrays, *(each for each in records.kept if isinstance(each, np.ndarray))]
        self.found |= {address_of(each): each for each in arrays}

    def put(self, content: bytes) -> int:
        """Append bytes, and return their address."""
        self.bytes += bytes(-len(self.bytes) % 16)
        address = BASE + len(self.bytes)
        self.bytes += content
        return address

    def at(self, place: int, blank: bool = False) -> int:
        """Return the address of what is at an address of this process; it is put here once."""
        if place not in self.places:
            content = self.translated(self.found[place])
            self.places[place] = self.put(bytes(len(content)) if blank else content)
        return self.places[place]

    def translated(self, thing: Any) -> bytes:
        """Return an array, records or a record with pointers into the image."""
        if isinstance(thing, np.ndarray):
            return thing.tobytes()
        if isinstance(thing, ctypes.Array):
            return b"".join(map(self.translated, thing))
        name, values = self.names[type(thing)], {}
        for member, kind in self.members[name]:
            values[member] = getattr(thing, member)
            if kind == "pointer":
                values[member] = values[member] and self.at(values[member], member in WRITTEN)
        return bytes(self.types[name](**{name: x for name, x in values.items() if x is not None}))

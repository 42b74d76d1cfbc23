"""The memory of a run in WebAssembly: its C records and arrays, with addresses of 32 bits."""

import ctypes
from typing import Any

import numpy as np

from ...model.memory import address_of
from ...simulation.records import Records

BASE = 2**21  # address of the image, above the stack and the constants of a module
ALIGNED = 16  # bytes
KINDS: dict[str, Any] = {
    "pointer": ctypes.c_uint32,
    "int": ctypes.c_int32,
    "long": ctypes.c_int32,
    "size_t": ctypes.c_uint32,
    "real": ctypes.c_double,
}
WRITTEN = {"work", "event_times", "event_kinds"}  # by C, before anybody reads them


class Image:
    """The bytes of records and arrays, to be copied to the address ``BASE``.

    records: with all that their pointers lead to; arrays: what else these lead to.
    """

    def __init__(self, records: Records, arrays: list[np.ndarray]):
        self.bytes = bytearray()
        self.places: dict[int, int] = {}  # address in this process -> address in the image
        self.members = records.code.manifest["simulation"]["records"]
        self.names = {kind: name for name, kind in records.types.items()}
        self.types = {
            name: type(name, (ctypes.LittleEndianStructure,), {"_fields_": fields})
            for name, members in self.members.items()
            for fields in [[(member, KINDS[kind]) for member, kind in members]]
        }
        self.found: dict[int, Any] = {}
        for each in (*records.kept, *arrays):
            if isinstance(each, np.ndarray):
                self.found[address_of(each)] = each
            elif isinstance(each, ctypes.Structure | ctypes.Array):
                self.found[ctypes.addressof(each)] = each

    def put(self, content: bytes) -> int:
        """Append bytes, and return their address."""
        self.bytes += bytes(-len(self.bytes) % ALIGNED)
        address = BASE + len(self.bytes)
        self.bytes += content
        return address

    def array(self, array: np.ndarray) -> int:
        """Return the address of an array, which is put here once."""
        self.found.setdefault(address_of(array), array)
        return self._at(address_of(array))

    def record(self, record: ctypes.Structure) -> int:
        """Put a record here, and all that it points to; return its address."""
        return self.put(bytes(self._translated(record)))

    def offsets(self, name: str) -> dict[str, tuple[int, str]]:
        """Return where the members of a record are, in bytes, and their kinds."""
        kind: Any = self.types[name]
        return {each: (getattr(kind, each).offset, of) for each, of in self.members[name]}

    def size(self, name: str) -> int:
        """Return the size of a record in bytes."""
        return ctypes.sizeof(self.types[name])

    def _translated(self, record: ctypes.Structure) -> ctypes.Structure:
        """Return a record whose pointers are addresses of the image."""
        name, values = self.names[type(record)], {}
        for member, kind in self.members[name]:
            value = getattr(record, member)
            if kind == "pointer":
                value = self._at(value, member in WRITTEN) if value else 0
            values[member] = value
        return self.types[name](**values)

    def _at(self, place: int, blank: bool = False) -> int:
        """Return the address of what is at an address of this process."""
        if place not in self.places:
            thing = self.found[place]
            if isinstance(thing, np.ndarray):
                content = bytes(thing.nbytes) if blank else thing.tobytes()
            elif isinstance(thing, ctypes.Array):
                content = b"".join(bytes(self._translated(each)) for each in thing)
            else:
                content = bytes(self._translated(thing))
            self.places[place] = self.put(content)
        return self.places[place]

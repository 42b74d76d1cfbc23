"""Records of the generated C: a manifest's list of members goes in, ctypes structures and kept
arrays come out.
"""

import ctypes
from functools import cached_property, lru_cache

import numpy as np


class Records:
    """Makes the C records of a model, and keeps alive all that they point to."""

    def __init__(self, model):
        self.model, self.kept = model, []
        self.dtype = model.parameter_vector.dtype
        self.real = np.ctypeslib.as_ctypes_type(self.dtype)
        self.members = model.manifest["simulation"]["records"]

    @cached_property
    def types(self) -> dict[str, type]:
        """Structure types by name."""
        rows = ((name, tuple(map(tuple, members))) for name, members in self.members.items())
        return {name: structure(name, members, self.real) for name, members in rows}

    def has(self, record: str, member: str) -> bool:
        """Tell if a record has a member."""
        return any(name == member for name, _ in self.members[record])

    def record(self, name: str, **members) -> ctypes.Structure:
        """Return a record, zero but for these members; arrays are given by their addresses."""
        found = self.types[name](
            **{member: self._plain(value) for member, value in members.items()}
        )
        self.kept.append(found)
        return found

    def records(self, name: str, items: list[ctypes.Structure]) -> ctypes.Array:
        """Return records one after another."""
        found = (self.types[name] * len(items))(*items)
        self.kept.append(found)
        return found

    def array(self, values) -> np.ndarray:
        """Return values as the model's reals, kept."""
        found = np.ascontiguousarray(values, self.dtype)
        self.kept.append(found)
        return found

    def _plain(self, value):
        if isinstance(value, np.ndarray):
            self.kept.append(value)
            return value.ctypes.data
        if isinstance(value, ctypes.Structure | ctypes.Array):
            return ctypes.addressof(value)
        return ctypes.cast(value, ctypes.c_void_p) if isinstance(value, ctypes._CFuncPtr) else value


@lru_cache(maxsize=64)
def structure(name: str, members: tuple, real: type) -> type[ctypes.Structure]:
    """Return the structure type of members, pairs of name and kind, made once: that takes some 40
    us.
    """
    kinds = {
        "pointer": ctypes.c_void_p,
        "int": ctypes.c_int,
        "long": ctypes.c_long,
        "size_t": ctypes.c_size_t,
    }
    kinds["real"] = real
    return type(
        name, (ctypes.Structure,), {"_fields_": [(member, kinds[kind]) for member, kind in members]}
    )

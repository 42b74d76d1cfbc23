"""The structures that the generated C takes, as ctypes has them, with all that they point to."""

import ctypes
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..model.kept import kept
from ..model.model import Model

CFunction: Any = type(ctypes.CFUNCTYPE(None)()).__mro__[1]  # of all functions that ctypes makes


class Records:
    """Makes the C records of a model, and keeps alive all that they point to."""

    def __init__(self, model: Model):
        self.model = model
        self.kept: list[Any] = []
        self.dtype = model.parameter_vector.dtype
        self.real = np.ctypeslib.as_ctypes_type(self.dtype)
        self.members = model.manifest["simulation"]["records"]

    @kept
    def types(self) -> dict[str, type[ctypes.Structure]]:
        """Structure types by name."""
        types = {}
        for name, members in self.members.items():
            types[name] = structure(name, tuple(map(tuple, members)), self.real)
        return types

    def has(self, record: str, member: str) -> bool:
        """Tell if a record has a member."""
        return any(name == member for name, _ in self.members[record])

    def record(self, name: str, **members: Any) -> ctypes.Structure:
        """Return a record, zero but for these members; arrays are given by their addresses."""
        record = self.types[name](**{key: self._plain(value) for key, value in members.items()})
        self.kept.append(record)
        return record

    def records(self, name: str, items: list[ctypes.Structure]) -> ctypes.Array:
        """Return records one after another."""
        array = (self.types[name] * len(items))(*items)
        self.kept.append(array)
        return array

    def array(self, values: ArrayLike) -> np.ndarray:
        """Return values as the model's reals, kept."""
        array = np.ascontiguousarray(values, self.dtype)
        self.kept.append(array)
        return array

    def _plain(self, value: Any) -> Any:
        """Return a value as a structure's member takes it."""
        if isinstance(value, np.ndarray):
            self.kept.append(value)
            return value.ctypes.data
        if isinstance(value, ctypes.Structure | ctypes.Array):
            return ctypes.addressof(value)
        return ctypes.cast(value, ctypes.c_void_p) if isinstance(value, CFunction) else value


@lru_cache(maxsize=64)
def structure(name: str, members: tuple, real: type) -> type[ctypes.Structure]:
    """Return the structure type of members, pairs of name and kind; making one takes 40 us."""
    kinds: dict[str, type] = {
        "pointer": ctypes.c_void_p,
        "int": ctypes.c_int,
        "long": ctypes.c_long,
        "size_t": ctypes.c_size_t,
        "real": real,
    }
    fields = [(member, kinds[kind]) for member, kind in members]
    return type(name, (ctypes.Structure,), {"_fields_": fields})

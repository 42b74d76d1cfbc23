"""The C structures of simulations, for ctypes, with all that they point to."""

import ctypes
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from ..model.memory import address_of
from ..model.model import Model
from ..model.structures import REALS, structure

CFunction: Any = type(ctypes.CFUNCTYPE(None)()).__mro__[1]  # base class of all ctypes functions


_types: WeakKeyDictionary[Any, dict[str, type[ctypes.Structure]]] = WeakKeyDictionary()  # by CDLL


OF_MEMORY = ctypes.Structure, ctypes.Array


class Records:
    """Makes the C records of a model, and keeps alive all that they point to."""

    def __init__(self, model: Model):
        self.model = model
        self.kept: list[Any] = []
        self.dtype = model.parameter_vector.dtype
        self.real = REALS[self.dtype]
        # all of one code: the model's is another one once a function was added
        self.code = code = model.kernels
        self.types = _types.get(code.library) or _types.setdefault(code.library, self._made())

    def _made(self) -> dict[str, type[ctypes.Structure]]:
        """Structure types by name."""
        members = self.code.manifest["simulation"]["records"]
        return {
            name: structure(name, tuple(map(tuple, each)), self.real)
            for name, each in members.items()
        }

    def has(self, record: str, member: str) -> bool:
        """Tell if a record has a member."""
        return hasattr(self.types[record], member)

    def record(self, name: str, **members: Any) -> ctypes.Structure:
        """Return a record, zero but for these members; arrays are given by their addresses."""
        for key, value in members.items():
            if type(value) not in (int, float):
                members[key] = self._plain(value)
        record = self.types[name](**members)
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
            return address_of(value)
        if isinstance(value, OF_MEMORY):
            return ctypes.addressof(value)
        return ctypes.cast(value, ctypes.c_void_p) if isinstance(value, CFunction) else value

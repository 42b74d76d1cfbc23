"""The C structures of generated models, for ctypes."""

import ctypes
from functools import lru_cache

import numpy as np

REALS = {np.dtype(real): real for real in (ctypes.c_float, ctypes.c_double)}


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


@lru_cache(maxsize=64)
def rows_of(kind: type[ctypes.Structure]) -> np.dtype:
    """Return the type of arrays of such structures; making one takes 200 us."""
    return np.dtype(kind)

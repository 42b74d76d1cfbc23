"""The same numbers in every form that NumPy knows, and an array that has none."""

import numpy as np


class Foreign:
    """An array of another package that refuses to be read."""

    def __array__(self, *_args, **_options):
        raise RuntimeError("no numbers in here")


class Labelled(np.ndarray):
    """A subclass of arrays, as packages of units have them."""


def locked(array):
    array = array.copy()
    array.setflags(write=False)
    return array


def misaligned(array):
    """The numbers of an array where no number begins at a multiple of its size."""
    memory = np.zeros(array.nbytes + 1, np.uint8)
    memory[1:] = array.reshape(-1).view(np.uint8)
    return memory[1:].view(array.dtype).reshape(array.shape)


# ways to give the same numbers, of any type
SOUND = {
    "plain": np.array,
    "list": np.ndarray.tolist,
    "tuple": lambda a: tuple(a.tolist()),
    "rows": list,
    "long double": lambda a: a.astype(np.longdouble),
    "other bytes": lambda a: a.astype(a.dtype.newbyteorder()),
    "Fortran": np.asfortranarray,
    "spread": lambda a: np.repeat(a, 3, axis=-1)[..., 1::3],
    "backward": lambda a: np.flip(np.flip(a).copy()),
    "read-only": locked,
    "unaligned": misaligned,
    "subclass": lambda a: a.copy().view(Labelled),
    "unmasked": lambda a: np.ma.masked_array(a, np.zeros(a.shape, bool)),
}

"""What users give: numbers in every form that NumPy knows, and what is no number at all."""

import datetime
import decimal
import fractions
from pathlib import Path

import numpy as np
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

EXTREMES = (0.0, -0.0, 5e-324, 1e-308, 1e-160, 1e160, 1e308, np.nan, np.inf, -np.inf)
NUMBERS = some.one_of(some.floats(-3, 3), some.sampled_from(EXTREMES), some.floats())
SHAPES = arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=13)


class Labelled(np.ndarray):
    """A subclass of arrays, as packages of units have them."""


class Foreign:
    """An array of another package that refuses to be read."""

    def __array__(self, *_args, **_options):
        raise RuntimeError("no numbers in here")


class Growing:
    """A sequence that is longer whenever it is asked."""

    def __init__(self):
        self.count = 0

    def __len__(self):
        self.count += 1
        return self.count

    def __getitem__(self, index):
        if index > 3:
            raise IndexError
        return 0.5


def plain(shape) -> some.SearchStrategy:
    """Return arrays of doubles of moderate size, as a model takes them."""
    moderate = some.floats(-2, 2, width=32)
    return arrays.arrays(np.float64, shape, elements=moderate, fill=some.nothing())


def holed(shape) -> some.SearchStrategy:
    """Return arrays of doubles of any size, most of them with what is no number."""
    return arrays.arrays(np.float64, shape, elements=NUMBERS)


def spread(array: np.ndarray) -> np.ndarray:
    """Return the same numbers, every third of a longer row."""
    return np.repeat(array, 3, axis=-1)[..., 1::3] if array.ndim else array


def locked(array: np.ndarray) -> np.ndarray:
    array = array.copy()
    array.setflags(write=False)
    return array


def unaligned(array: np.ndarray) -> np.ndarray:
    """Return the same numbers at an odd address."""
    memory = np.zeros(array.nbytes + 1, np.uint8)
    found = memory[1:].view(np.float64).reshape(array.shape)
    found[...] = array
    return found


# other forms of the same numbers: each must give the same bits
FORMS = {
    "list": np.ndarray.tolist,
    "tuple": lambda a: tuple(a.tolist()) if a.ndim else a.tolist(),
    "float32": lambda a: a.astype(np.float32),
    "long double": lambda a: a.astype(np.longdouble),
    "other bytes": lambda a: a.astype(">f8"),
    "Fortran": np.asfortranarray,
    "spread": spread,
    "backward": lambda a: np.flip(np.flip(a).copy()),
    "read-only": locked,
    "unaligned": unaligned,
    "subclass": lambda a: a.copy().view(Labelled),
    "unmasked": lambda a: np.ma.masked_array(a, np.zeros(a.shape, bool)),
    "rows": lambda a: list(a.copy()) if a.ndim else a,
}
JUNK = some.one_of(
    some.none(),
    some.booleans(),
    some.text(max_size=4),
    some.binary(max_size=8),
    some.integers(),
    some.integers(-(2**70), 2**70),
    some.complex_numbers(),
    NUMBERS,
    some.lists(some.one_of(some.none(), NUMBERS, some.lists(NUMBERS, max_size=3)), max_size=13),
    some.dictionaries(some.text(max_size=2), NUMBERS, max_size=2),
    some.one_of(*map(some.builds, (set, object, Foreign, Growing))),
    some.sampled_from(
        [
            *(Ellipsis, slice(None), range(9), Path("x"), 10**400, NotImplemented, int, len),
            *(decimal.Decimal("0.5"), fractions.Fraction(1, 3), datetime.date(2000, 1, 1)),
        ]
    ),
    some.builds(lambda n: memoryview(bytes(8 * n)), some.integers(0, 13)),
    some.builds(lambda n: (x for x in range(n)), some.integers(0, 13)),
)
DTYPES = some.one_of(
    *(arrays.boolean_dtypes(), arrays.complex_number_dtypes(), arrays.datetime64_dtypes()),
    arrays.integer_dtypes(endianness="?"),
    arrays.unsigned_integer_dtypes(endianness="?"),
    arrays.floating_dtypes(endianness="?"),
    arrays.byte_string_dtypes(max_len=4),
    arrays.unicode_string_dtypes(max_len=4),
)
ANY_ARRAY = some.one_of(
    DTYPES.flatmap(lambda dtype: arrays.arrays(dtype, SHAPES)),
    SHAPES.map(lambda shape: np.full(shape, None)),
    SHAPES.map(lambda shape: np.full(shape, 0.5, object)),
    SHAPES.map(np.ma.masked_all),
    SHAPES.map(lambda shape: np.zeros(shape, [("x", float)])),
)


def strange(shape=()) -> some.SearchStrategy:
    """Return anything: in place of an array of a shape, or of what no shape is known of."""
    wide = (3, *shape)
    near = [holed(shape), holed(wide), holed((*shape, 1)), holed((0, *shape)), plain(wide)]
    return some.one_of(JUNK, ANY_ARRAY, *near)

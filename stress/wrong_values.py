"""Wrong values that a caller may give by mistake, similar to valid ones."""

import math
from pathlib import Path

import numpy as np


@np.errstate(all="ignore")  # casts of values that the type does not have
def values(like, rng) -> list:
    """Return values to give instead of an argument: wrong types, shapes, layouts and numbers, and
    right ones.
    """
    try:
        plain = np.asarray(like, float)
    except (TypeError, ValueError):
        plain = np.zeros(3)
    holed = plain.copy().reshape(-1)
    if holed.size:
        holed[rng.integers(holed.size)] = rng.choice(
            [np.nan, np.inf, -np.inf, 1e308, -1e160, 5e-324]
        )
    batch = np.stack([plain] * 3)
    return [
        *(
            None,
            "x",
            b"",
            "",
            [],
            [[]],
            {},
            set(),
            object(),
            Ellipsis,
            slice(None),
            1j,
            True,
            "nan",
            Path("nowhere"),
        ),
        *(
            math.nan,
            math.inf,
            -1,
            0,
            -0.0,
            1e-320,
            1e308,
            10**400,
            2**63,
            -(2**70),
            np.float32(3),
            np.int8(3),
        ),
        *(
            np.array(1, object),
            np.zeros(0),
            np.zeros((2, 0)),
            np.zeros(3, complex),
            np.array(["a"]),
        ),
        *(
            np.datetime64("now"),
            range(3),
            (1, 2),
            [1, [2, 3]],
            np.ma.masked_array([1.0, 2.0], [0, 1]),
            np.array(7),
        ),
        *(
            plain,
            plain.tolist(),
            plain[None],
            plain[..., None],
            np.atleast_1d(plain)[1:],
            np.atleast_1d(plain)[::-1],
            plain.astype(np.float32),
        ),
        *(
            plain.astype(np.float16),
            np.zeros_like(plain),
            plain * np.nan,
            plain * 1e300,
            plain * 1e155,
            plain * 1e-200,
        ),
        *(
            batch,
            batch[:0],
            np.asfortranarray(batch),
            batch[::-1],
            np.stack([batch] * 2),
            plain.astype(">f8"),
        ),
        *(
            holed.reshape(plain.shape),
            np.repeat(plain, 2)[::2],
            plain.astype(int),
            plain.astype("U8"),
        ),
        *(
            np.broadcast_to(plain, (2, *plain.shape)),
            memoryview(plain.tobytes()),
            plain.astype(object),
        ),
    ]

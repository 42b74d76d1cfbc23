"""Numbers to run on: floats, and fractions with exact stand-ins for sine, cosine and root.

The stand-ins obey the only laws that folding may use: sin is odd, cos even, and their values at 0
and 1.
"""

import math
from fractions import Fraction
from types import SimpleNamespace

from serpentail_codegen.ir.interpret import Numbers

FLOATS = Numbers(math, float)
RATIONAL = Numbers(
    SimpleNamespace(
        sin=lambda x: x / (1 + x * x), cos=lambda x: 1 / (1 + x * x), sqrt=lambda x: x * x
    ),
    Fraction,
)

"""What a model may be called: a C identifier, and a name for files and folders; no path.

The generator has the same rule, in ``serpentail_codegen/scene/scene.py``.
"""

import re

from ..checks import refusal
from ..errors import ModelError

# a model of such a name would hide the system's header
C_HEADERS = (
    "assert|complex|ctype|errno|features|fenv|float|inttypes|iso646|limits|locale|math|setjmp|"
    "signal|stdarg|stdbool|stddef|stdint|stdio|stdlib|string|tgmath|time|wchar|wctype"
)
NEEDS = (
    "a text of up to 63 of a-z, 0-9 and _, a letter first, that names no C header: rename the "
    'file, or set name = "..." in it'
)


def checked_name(name: object) -> str:
    """Return the name of a scene's model; ModelError where no model can be called so."""
    if isinstance(name, str) and re.fullmatch(f"(?!({C_HEADERS})$)[a-z][a-z0-9_]{{0,62}}", name):
        return name
    raise refusal("name", name, NEEDS, ModelError)

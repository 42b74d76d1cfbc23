"""Writes the gains of a plan as C of their own, for machines without Python."""

import re

import numpy as np

from ..c_text import array_text, literal
from .kernel import ARRAYS, NATIVE, sizes

NAME = re.compile(r"\b(gains_|GAINS_)")
USE = """
/* The gains of one plan:

   static gains_real memory[GAINS_MEMORY];
   gains_state state;
   gains_begin(&state, &gains_plan, memory);

   Then, every gains_plan.period seconds from the start of the flight, call
   gains_tick(&state, t, q, v, tau). */
enum {{ GAINS_MEMORY = {memory} }};

extern const gains_task gains_plan;
"""


def texts_of(
    prefix: str, tables: dict[str, np.ndarray], period: float, real: str
) -> dict[str, str]:
    """Return header and source by their names; the tick of gains.c, then the tables.

    prefix: of all names. tables: of ``gains_task``. period: s. real: "float" or "double".
    """
    header, source = ((NATIVE / f"gains.{end}").read_text(encoding="utf-8") for end in "hc")
    begin, end = header.replace("typedef double", f"typedef {real}").rsplit("\n#ifdef __cpl", 1)
    header = f"{begin}{USE.format(memory=8 + 2 * sizes(tables)[0])}\n#ifdef __cpl{end}"

    for name in ARRAYS:
        source += "\n" + array_text(name, tables[name], real, "gains_real")
    numbers = ", ".join(map(str, sizes(tables)))
    members = f"{numbers}, {literal(period, real)}, {', '.join(ARRAYS)}"
    source += f"\nconst gains_task gains_plan = {{{members}}};\n"
    source = source.replace('"gains.h"', f'"{prefix}_gains.h"')

    marks = {"gains_": f"{prefix}_gains_", "GAINS_": f"{prefix.upper()}_GAINS_"}
    return {
        f"{prefix}_gains.{end}": NAME.sub(lambda found: marks[found[0]], text)
        for end, text in (("h", header), ("c", source))
    }

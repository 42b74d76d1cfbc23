"""Programs of the catalogue for few tails, and all numbers that they give."""

from functools import cache

import numpy as np

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run

TAILS = {
    "m1_n3": Tail(1, 3),
    "m3_n4": Tail(3, 4),
    "m6_n6": Tail(6, 6),
    "arcs3": Tail(3, 4, "continuum"),
}


@cache
def program_of(name, tail):
    """The program of a function for one of the tails."""
    return assemble(CATALOGUE[name].of(TAILS[tail]), TAILS[tail])


def outputs(program):
    """All that a program gives for random numbers."""
    rng = np.random.default_rng(4)
    given = (*program.of_role("parameters"), *program.of_role("input"))
    numbers = {a.name: rng.uniform(0.1, 1, a.length).tolist() for a in given}
    values = Run(program, Numbers(np), numbers).values
    return [float(x) for a in program.of_role("output") for x in values[a.name]]

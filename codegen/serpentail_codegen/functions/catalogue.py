"""All functions that can be emitted: each signature with its assembly, in the order of the
table.
"""

from serpentail_scene.signatures.table import SIGNATURES

from . import air, contact, pfl, pushes, tendons
from .airborne import curvature as airborne
from .derivatives import by_parameters, hessian, jacobians, rates
from .derivatives.differentiated import FUNCTIONS
from .function import Function, signed
from .implicit import factor, solve
from .tail import Tail

_FOUND = FUNCTIONS | signed(
    jacobians.ASSEMBLIES
    | by_parameters.ASSEMBLIES
    | hessian.ASSEMBLIES
    | air.ASSEMBLIES
    | tendons.ASSEMBLIES
    | contact.ASSEMBLIES
    | pfl.ASSEMBLIES
    | pushes.ASSEMBLIES
    | {"implicit_factor": factor.assemble_factor, "implicit_solve": solve.assemble_solve}
    | airborne.ASSEMBLIES
    | rates.ASSEMBLIES
)
# A signature without outputs stands for other functions and has no assembly of its own.
CATALOGUE = {name: _FOUND[name] for name, s in SIGNATURES.items() if s.outputs}


def function_of(name: str, tail: Tail) -> Function:
    """Return a function of a tail, with the arguments that it has for that tail."""
    return CATALOGUE[name].of(tail)


SYMBOLIC = {name for name in CATALOGUE if SIGNATURES[name].symbolic}  # in the CasADi module

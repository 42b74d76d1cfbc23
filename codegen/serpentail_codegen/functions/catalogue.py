"""All functions that can be emitted: every signature with its assembly, in the table's order."""

from ..scene.signatures.table import SIGNATURES
from . import contact, pfl
from .derivatives import by_parameters, hessian, jacobians
from .function import signed
from .implicit import functions as implicit
from .plain import FUNCTIONS

_FOUND = FUNCTIONS | signed(
    jacobians.ASSEMBLIES
    | by_parameters.ASSEMBLIES
    | hessian.ASSEMBLIES
    | contact.ASSEMBLIES
    | pfl.ASSEMBLIES
    | implicit.ASSEMBLIES
)
# A signature without outputs stands for others: nothing is assembled for it.
CATALOGUE = {name: _FOUND[name] for name, s in SIGNATURES.items() if s.outputs}
SYMBOLIC = {name for name in CATALOGUE if SIGNATURES[name].symbolic}  # in the CasADi module

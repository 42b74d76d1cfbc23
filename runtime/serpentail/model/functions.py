"""All methods of a model that evaluate its functions, and their names in other libraries."""

from .methods.airborne import AirborneMethods
from .methods.contact import ContactMethods
from .methods.dynamics import DynamicsMethods
from .methods.inverse_derivatives import InverseDerivativeMethods
from .methods.measures import MeasureMethods
from .methods.state import StateMethods


class Functions(
    StateMethods, MeasureMethods, ContactMethods, InverseDerivativeMethods, AirborneMethods
):
    """All methods of a model that evaluate compiled functions."""

    # their names in Pinocchio
    crba = DynamicsMethods.mass_matrix
    nle = DynamicsMethods.bias_force
    rnea = DynamicsMethods.inverse_dynamics
    aba = DynamicsMethods.forward_dynamics

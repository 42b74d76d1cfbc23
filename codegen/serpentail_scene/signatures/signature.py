"""A row of the table of functions: what is known about a function before it is derived."""

from dataclasses import dataclass

from .arguments import Argument

# Groups of functions.
VALUE = "value"
DERIVATIVE = "derivative"
CONTACT = "contact"  # only in scenes with contacts
CONTROL = "control"
IMPLICIT = "implicit"
SIMULATION = "simulation"
PLANNING = "planning"


@dataclass(frozen=True)
class Signature:
    """A function: name, meaning, arguments and group.

    A signature without outputs stands for several functions: a scene names it, nobody calls it.
    ``exact`` lists functions by which CasADi differentiates calls of the compiled code: first those
    for Jacobians, then those for gradients, then what second derivatives need besides. ``needs`` is
    a group of contact points, or "contacts" for any of them; empty: every scene may have it.
    ``called``: it comes with the functions that call it, and scenes do not name it.
    """

    name: str
    doc: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]
    group: str
    exact: tuple[tuple[str, ...], ...] = ()
    needs: str = ""
    called: bool = False

    @property
    def symbolic(self) -> bool:
        """Tell if the CasADi module builds it from operations."""
        return self.group in (VALUE, CONTACT, CONTROL)

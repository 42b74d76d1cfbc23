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

# When a function is emitted.
ALWAYS = "always"  # unless the scene chooses its functions
GROUND = "with contacts"  # the same in scenes with contacts; in others only if a scene names it
NAMED = "where named"
CALLED = "with its callers"  # with the functions that call it; scenes cannot name it


@dataclass(frozen=True)
class Signature:
    """A function: name, meaning, arguments, group, and when it is emitted.

    A signature without outputs stands for several functions: a scene names it, nobody calls it.
    ``exact`` lists functions by which CasADi differentiates calls of the compiled code: first those
    for Jacobians, then those for gradients, then what second derivatives need besides. ``needs`` is
    a group of contact points, or "contacts" for any of them; empty: every scene may have it.
    """

    name: str
    doc: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]
    group: str
    emitted: str
    exact: tuple[tuple[str, ...], ...] = ()
    needs: str = ""

    @property
    def symbolic(self) -> bool:
        """Tell if the CasADi module builds it from operations."""
        return self.group in (VALUE, CONTACT, CONTROL)

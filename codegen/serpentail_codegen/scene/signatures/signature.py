"""What is known of a function before it is derived: a row of the table of functions."""

from dataclasses import dataclass

from .arguments import Argument

# Groups: what a function belongs to.
VALUE = "value"
DERIVATIVE = "derivative"
CONTACT = "contact"  # scenes with contacts alone have them
CONTROL = "control"
IMPLICIT = "implicit"
SIMULATION = "simulation"
PLANNING = "planning"

# When a function is emitted.
ALWAYS = "always"  # unless the scene chooses its functions
GROUND = "with contacts"  # the same, in scenes with contacts; in others where a scene names it
NAMED = "where named"
CALLED = "with its callers"  # no scene names it


@dataclass(frozen=True)
class Signature:
    """A function: name, what it computes of what, its group, and when it is emitted.

    One without outputs stands for others that it is made of: a scene names it, nobody calls it.
    ``exact`` are the functions that its Jacobians are made of, then those that gradients are, then
    what second derivatives need beside them: so CasADi differentiates calls of the compiled code.
    ``needs`` is a group of contact points, or "contacts" for any of them; empty: every scene may
    have it.
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
        """Tell if the CasADi module builds it of operations."""
        return self.group in (VALUE, CONTACT, CONTROL)

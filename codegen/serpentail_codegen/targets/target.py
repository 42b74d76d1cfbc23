"""The protocol of every target: a package for one language in which programs are printed.

A target's package holds a printer, templates and a ``Target``. The printer turns the statements of
a program into lines of text. The templates arrange the lines as files. The ``Target`` names both
for the pipeline. The printer has one method for each kind of statement, chosen by the statement's
type. A statement that it does not know, or cannot print, ends the generation with an error and is
never left out.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from ..functions.function import Function
from ..functions.tail import Tail
from ..scene.scene import Scene

SEAL = "\0content hash\0"  # placeholder in a target's texts: the pipeline replaces it by the hash


class UnprintableStatement(ValueError):
    """A target was asked for a statement that it cannot print."""


class Printer(Protocol):
    """Prints programs in one language.

    ``statement``, a ``functools.singledispatchmethod`` made from ``unknown_statement``, has a
    method for every kind of statement in ir/program.py.
    """

    @property
    def statement(self) -> Callable[..., list[str]]:
        """Return the method that prints a statement."""


def unknown_statement(printer: Printer, statement: object) -> list[str]:
    """Refuse a kind of statement that a printer has no method for."""
    raise UnprintableStatement(
        f"{type(printer).__name__} has no method for {type(statement).__name__}: register one with "
        "`statement`, or refuse it there with the reason"
    )


def refused(printer: Printer, statement: object, reason: str) -> UnprintableStatement:
    """Return the error that a language cannot express a statement."""
    kind = type(statement).__name__
    return UnprintableStatement(f"{type(printer).__name__} cannot print {kind}: {reason}")


def body_lines(printer: Printer, body: Iterable[object]) -> list[str]:
    """Return the lines of statements in order."""
    return [line for statement in body for line in printer.statement(statement)]


@dataclass(frozen=True)
class Emission:
    """The result of a target for a scene: files, and what a loader must know about them."""

    files: dict[str, str]  # text by path
    derivation: tuple[str, ...]  # paths of the files whose texts determine the content hash
    entries: dict[str, Any]  # of the manifest
    functions: dict[str, dict[str, Any]]  # of each function in the manifest, besides its arguments


@dataclass(frozen=True)
class Target:
    """A language: its name in a scene, its printer, and the function that makes the files of a
    scene.
    """

    name: str
    printer: type[Printer]
    emit: Callable[[Scene, Tail, Iterable[Function], str], Emission]

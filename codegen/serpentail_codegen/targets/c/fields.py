"""A member of a C record."""

import re
from dataclasses import dataclass
from textwrap import dedent


@dataclass(frozen=True)
class Field:
    """One member of a C record: its name, type and meaning."""

    name: str
    type: str
    meaning: str

    @property
    def kind(self) -> str:
        """Return what a caller in another language stores in it."""
        return "pointer" if "*" in self.type or self.type == "torque" else self.type


def fields(table: str) -> list[Field]:
    """Return the members of a record, a line each, such as ``real *q: configuration``.

    A line goes on in lines that are indented more.
    """
    rows = re.findall(r"^(\S.*?)(\w+): (.*(?:\n .*)*)", dedent(table), re.MULTILINE)
    return [Field(name, kind.strip(), " ".join(text.split())) for kind, name, text in rows]

"""What a verb came to, and how that is printed."""

import os
import sys
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

Files = Mapping[
    str, Callable[[str], object]
]  # option with the file's name -> function that writes it


class Outcome(NamedTuple):
    """What a verb came to: a report as data and as text, whether all is well, files to write."""

    report: dict[str, Any]
    text: str
    good: bool = True
    files: Files = MappingProxyType({})


def tell(text: str) -> None:
    """Print a report; whoever reads it may stop to."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

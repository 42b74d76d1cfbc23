"""What a verb came to, how that is printed, and the files that options ask for.

Files are checked before the work and written after it.
"""

import argparse
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from ..basics.errors import SerpentailError
from ..basics.extras import needed
from ..basics.files import refuse_unwritable

OPTIONS = ("save", "film", "view", "plot")
SEPARATORS = ("/", os.sep)
Files = Mapping[str, Callable[[str], object]]  # option with the file's name -> what writes it


class VerbOutcome(NamedTuple):
    """What a verb came to: a report as data and as text, whether all is well, files to write."""

    report: dict[str, Any]
    text: str
    good: bool = True
    files: Files = MappingProxyType({})


def print_report(text: str) -> None:
    """Print a report; whoever reads it may stop to."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def refuse_targets(arguments: argparse.Namespace) -> None:
    """SerpentailError if a file could not be written when the work is done."""
    if getattr(arguments, "view", None) is not None:
        from ..show.page.view import template

        template()
    if getattr(arguments, "live", False):
        if arguments.view is None:
            raise SerpentailError("--live: without --view there is no page: add --view run.html")
        needed("ziglang", "live")
    for option in OPTIONS:
        path = getattr(arguments, option, None)
        try:
            if path is not None and path.endswith(SEPARATORS):
                raise IsADirectoryError(f"{path} is a folder")
            if path is not None:
                refuse_unwritable(target(option, path))
        except (OSError, ValueError) as error:
            raise SerpentailError(f"--{option} {path}: {error}; name another file") from error


def target(option: str, path: str) -> Path:
    """Return the path of an option's file; ValueError if its suffix is unknown."""
    if option == "film":
        from ..show.pictures.film import film_path

        return film_path(path)
    if option == "view":
        from ..show.page.view import checked_path

        return checked_path(path)
    if option == "plot":
        from ..show.pictures.style import figure_path

        needed("matplotlib", "plot")
        return figure_path(path)
    from ..bridges.containers.tables import checked

    return checked(path)


def write(arguments: argparse.Namespace, option: str, make: Callable[[str], object]) -> bool:
    """Write the file that an option asks for; return False and print the reason if that fails."""
    path = getattr(arguments, option)
    if path is None:
        return True
    try:
        make(path)
    except Exception as error:  # whatever a picture or a disk fails by, the report is out
        cause = error.__cause__ if isinstance(error.__cause__, Exception) else error
        cause = cause.__cause__ if isinstance(cause.__cause__, OSError) else cause
        refused = cause.strerror if isinstance(cause, OSError) else None  # without the path again
        reason = refused or " ".join(str(error).split()) or type(error).__name__
        print(f"--{option} {path}: could not be written: {reason:.300}", file=sys.stderr)
        return False
    return True

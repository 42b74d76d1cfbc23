"""The front of a script: its arguments, and one line for what ends it.

It imports nothing that takes time: a script imports its work where it does it, so that `--help` and
mistakes are answered at once.
"""

import argparse
import signal
import sys
from collections.abc import Callable, Collection
from pathlib import Path

import serpentail as st
from serpentail.basics.files import refuse_unusable

ROOT = Path(__file__).resolve().parent.parent
GOES_ON = "the same command goes on from here"


def parser(words: str | None, output: str | None = None) -> argparse.ArgumentParser:
    """Return a parser of a script's arguments, without any but the folder of its results.

    words: the script's docstring; output: that folder by default, below the root; None: no such
    argument.
    """
    text, module = argparse.RawDescriptionHelpFormatter, sys.modules["__main__"].__spec__
    prog = f"python -m {module.name.removesuffix('.__main__')}" if module else None
    p = argparse.ArgumentParser(prog, None, words, allow_abbrev=False, formatter_class=text)
    if output is not None:
        told = f"where results go (default: {output} of the checkout)"
        default = str(ROOT / output)
        p.add_argument("folder", nargs="?", type=usable, default=default, help=told)
    return p


def usable(folder: str) -> Path:
    """Return the path of a folder for results; ArgumentTypeError where it cannot be one."""
    place = Path(folder).absolute()
    try:
        refuse_unusable(place)
    except OSError as reason:
        raise argparse.ArgumentTypeError(
            f"{folder!r}: {reason}: give a folder that can be written to, or made"
        ) from None
    return place


def one_of(known: Collection[str]) -> Callable[[str], str]:
    """Return what takes one of these names; it raises ArgumentTypeError where it is none."""

    def name(text: str) -> str:
        if text not in known:
            raise argparse.ArgumentTypeError(f"{text!r}: needs one of {', '.join(known)}")
        return text

    return name


def count(text: str) -> int:
    """Return a number of things from 1; ArgumentTypeError where it is none."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r}: needs a whole number from 1")
    return int(text)


def run(work: Callable[..., int | None], *given: object, after: str = "nothing is kept") -> None:
    """Do a script's work, tell on stderr how far it is, and end with its status.

    An error of serpentail, and Ctrl-C (status 130), end it in one line; after: what that says of
    what was done until then.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's job may ignore it
    try:
        with st.progress():
            sys.exit(work(*given))
    except st.SerpentailError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        print(f"interrupted: {after}", file=sys.stderr, flush=True)
        sys.exit(130)

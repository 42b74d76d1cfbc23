"""The command `serpentail`: scenes, motions, plans and models from a shell."""

import sys

INTERRUPTED = 130  # status of a command that Ctrl-C ended: 128 and the signal's number
try:
    import argparse
    import json
    import warnings
    from importlib import import_module
    from typing import Any

    from ..basics.errors import SerpentailError
    from ..basics.progress import progress
    from .arguments import parser
    from .outcome import VerbOutcome, print_report, refuse_targets, write
except KeyboardInterrupt:  # these take longer than Python itself
    sys.exit(INTERRUPTED)

ROOMS = {  # modules, each with a function of the name of each verb
    "scenes": ("examples", "new", "generate", "schema", "completion"),
    "motions": ("simulate", "plan", "identify", "sweep", "view", "compare"),
    "models": ("info", "verify", "export", "cache"),
}


def main(argv: list[str] | None = None) -> int:
    """Run a verb; 0 if it went well, 1 if a check or a file failed, 2 if the input was refused, 130
    after Ctrl-C.
    """
    try:
        return done(arguments_of(argv))
    except KeyboardInterrupt:
        print("serpentail: interrupted", file=sys.stderr)
        return INTERRUPTED


def done(arguments: argparse.Namespace) -> int:
    """Run a verb, tell of what it refuses, and return the status."""
    try:
        refuse_targets(arguments)
        with progress(), warnings.catch_warnings():
            warnings.showwarning = tell_warning
            outcome = run(arguments)
    except SerpentailError as error:
        print(error, file=sys.stderr)
        return 2
    except OSError as error:  # a path that the system refuses, a disk that is full
        print(f"{arguments.verb}: {error!s:.300}", file=sys.stderr)
        return 2
    return outcome if isinstance(outcome, int) else finished(arguments, outcome)


def arguments_of(argv: list[str] | None) -> argparse.Namespace:
    """Return the arguments; those of ``generate`` as words, because the generator reads them."""
    root = parser()
    arguments, words = root.parse_known_args(argv)
    if words and arguments.verb != "generate":
        root.error(f"unrecognized arguments: {' '.join(words)}")
    arguments.words = words
    return arguments


def tell_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print a warning as a line on stderr."""
    print(f"serpentail: warning: {message}", file=sys.stderr)


def run(arguments: argparse.Namespace) -> VerbOutcome | int:
    """Return the outcome of a verb; the status if the verb prints its own output."""
    (room,) = (room for room, verbs in ROOMS.items() if arguments.verb in verbs)
    module = import_module(f".{room}", __package__)
    outcome: VerbOutcome | int = getattr(module, arguments.verb)(arguments)
    return outcome


def finished(arguments: argparse.Namespace, outcome: VerbOutcome) -> int:
    """Print a report, write the files that were asked for, and return the status."""
    print_report(json.dumps(outcome.report) if getattr(arguments, "json", None) else outcome.text)
    written = [write(arguments, *entry) for entry in outcome.files.items()]
    if outcome.report.get("stopped") == "interrupt":
        print("serpentail: interrupted; this is the result until then", file=sys.stderr)
        return INTERRUPTED
    return 0 if outcome.good and all(written) else 1

"""What a command says on stderr, besides how far it is."""

import re

PROGRESS = re.compile(
    r"(?m)^(?:derive|compile|simulate|plan|identify|sweep) .*: .*\d s(?: so far| left)?\n"
)


def besides_progress(words):
    """Return what was said without the lines about long work."""
    return PROGRESS.sub("", words)

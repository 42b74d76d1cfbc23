"""The messages of a command on stderr, without its progress."""

import re

PROGRESS = re.compile(
    r"(?m)^(?:derive|compile|simulate|plan|identify|sweep) .*: .*\d s(?: so far| left)?\n"
)


def besides_progress(words):
    """Return the text without the lines about long work."""
    return PROGRESS.sub("", words)

"""The deepest chain of calls of each function, from gcc's call graphs."""

import re
from collections import defaultdict
from pathlib import Path

NODE = re.compile(r'^node: \{ title: "([^"]*)" label: "([^"]*)"', re.MULTILINE)
EDGE = re.compile(r'^edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', re.MULTILINE)
SIZE = re.compile(r"(\d+) bytes \((\w+)")


class StackUnknown(RuntimeError):
    """A chain of calls whose depth is not known when it is compiled: recursion, or a frame of
    variable size.
    """


def deepest(graphs: list[Path]) -> dict[str, int]:
    """Return bytes of stack by function, with all that it calls; functions of libc and libgcc count
    nothing.
    """
    frames, calls = {}, defaultdict(set)
    for path in graphs:
        text = path.read_text()
        for title, label in NODE.findall(text):
            found = SIZE.search(label)
            if found:
                frames[title] = (int(found[1]), found[2])
        for source, target in EDGE.findall(text):
            calls[source].add(target)
    return {title.rsplit(":", 1)[-1]: _depth(title, frames, calls, ()) for title in frames}


def _depth(title: str, frames: dict, calls: dict, chain: tuple[str, ...]) -> int:
    if title in chain:
        raise StackUnknown(f"{' -> '.join((*chain, title))}: it calls itself")
    if title not in frames:
        return 0
    size, kind = frames[title]
    if kind != "static":
        raise StackUnknown(f"{title}: its frame is {kind}")
    return size + max(
        (_depth(target, frames, calls, (*chain, title)) for target in calls[title]), default=0
    )

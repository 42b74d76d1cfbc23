"""What a function of a model costs with all that it calls: bytes of flash, and of stack."""

import re
from collections import defaultdict
from pathlib import Path

from checks.embedded.image import Image, command

NODE = re.compile(r'^node: \{ title: "([^"]*)" label: "([^"]*)"', re.MULTILINE)
EDGE = re.compile(r'^edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', re.MULTILINE)
SIZE = re.compile(r"(\d+) bytes \((\w+)")


class StackUnknown(RuntimeError):
    """A chain of calls whose depth is not known when it is compiled: recursion, or a frame of
    variable size.
    """


def flash(image: Image, name: str) -> int:
    """Return bytes of code and constants of one function with all that it calls, without libc."""
    prefix, board = image.manifest["prefix"], image.board
    linked = str(image.path.with_name(f"{name}.elf"))
    options = ["-nostdlib", "-Wl,--gc-sections", f"-Wl,-e,{prefix}_{name}"]
    options += ["-Wl,--unresolved-symbols=ignore-all"]
    source = str(image.path.with_name(f"{prefix}.o"))
    command([board.compiler, *board.cpu, *options, source, "-o", linked])
    size = board.compiler.replace("gcc", "size")
    return int(command([size, linked]).splitlines()[1].split()[0])


def deepest(graphs: list[Path]) -> dict[str, int]:
    """Return bytes of stack by function, along its deepest chain of calls in gcc's call graphs;
    functions of libc and libgcc count nothing.
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

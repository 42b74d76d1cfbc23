"""Draws a sample of all mutations by a seed, in equal parts from the generator's Python, from its
templates and from the runtime.
"""

import hashlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import chain, zip_longest
from pathlib import Path

from . import python_source, template_source
from .mutation import Mutation

PARTS = {
    "generator": ("codegen/serpentail_codegen", ".py"),
    "templates": ("codegen/serpentail_codegen/targets", ".jinja"),
    "runtime": ("runtime/serpentail", ".py"),
}
NOT_RUN = ("templates/package/", "templates/model/example.c.jinja")  # texts for people


def drawn(root: Path, count: int, seed: int, only: str = "") -> list[Mutation]:
    """Return so many mutations, of each part in turn; more of the same seed begin with fewer, and a
    change of the sources changes few of them.
    """

    def lot(mutation: Mutation) -> bytes:
        return hashlib.sha256(f"{seed} {mutation.key}".encode()).digest()

    shuffled = [sorted(of_part(root, part), key=lot) for part in PARTS]
    return [m for m in chain(*zip_longest(*shuffled)) if m and only in m.path][:count]


@cache
def of_part(root: Path, part: str) -> tuple[Mutation, ...]:
    """Return all mutations of a part."""
    folder, suffix = PARTS[part]
    paths = [file.relative_to(root).as_posix() for file in (root / folder).rglob(f"*{suffix}")]
    run = [path for path in sorted(paths) if not any(words in path for words in NOT_RUN)]
    return tuple(mutation for path in run for mutation in of_file(root, path))


def of_file(root: Path, path: str) -> Iterator[Mutation]:
    """Yield all mutations of a file, equal ones numbered."""
    source, seen = (root / path).read_bytes(), Counter()
    found = python_source if path.endswith(".py") else template_source
    for mutation in found.mutations(path, source):
        same = mutation.text, mutation.change
        yield replace(mutation, nth=seen[same])
        seen[same] += 1


def part_of(path: str) -> str:
    """Return the part to which a file belongs."""
    fits = (
        name for name, (top, end) in PARTS.items() if path.startswith(top) and path.endswith(end)
    )
    return next(fits)

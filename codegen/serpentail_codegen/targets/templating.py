"""Renders templates by Jinja2; a target has its own in the folder `templates` of its package."""

import os
import sys
from contextlib import suppress
from functools import cache
from importlib.util import cache_from_source
from pathlib import Path

from jinja2 import (
    Environment,
    FileSystemBytecodeCache,
    PackageLoader,
    StrictUndefined,
    pass_context,
)
from jinja2.bccache import Bucket

from serpentail_scene.digest import installed

from .expressions import literal


class CompiledTemplates(FileSystemBytecodeCache):
    """Keeps compiled templates beside the compiled modules of Python, and under the same rules.

    To compile them takes a fifth of a run. One serves for one text, one version of Jinja2, and one
    of this file, which sets the options.
    """

    def __init__(self) -> None:
        super().__init__(os.path.dirname(cache_from_source(__file__)))
        self.tool = installed("jinja2") + Path(__file__).read_text(encoding="utf-8")

    def get_source_checksum(self, source: str) -> str:
        """Return the digest of all that a compiled template depends on."""
        return super().get_source_checksum(self.tool + source)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Write a compiled template, where Python would write a compiled module."""
        if not sys.dont_write_bytecode:
            with suppress(OSError):
                super().dump_bytecode(bucket)


@cache
def environment(target: str) -> Environment:
    """Return the environment of a target's templates; an undefined name in one is an error."""
    made = Environment(
        loader=PackageLoader(f"serpentail_codegen.targets.{target}"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
        bytecode_cache=CompiledTemplates(),
    )
    made.filters["number"] = number
    return made


@pass_context
def number(context, value) -> str:
    """Print a number as a literal of the scene's real type: ``{{ 0.5 | number }}``."""
    return literal(value, context["real"])


def render(target: str, template: str, data: dict) -> str:
    """Render one template of a target."""
    return environment(target).get_template(template).render(data)

"""Jinja2 set up once: a template's name and its data go in, text comes out."""

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined


@cache
def environment() -> Environment:
    """Return the environment; an undefined name in a template is an error."""
    return Environment(
        loader=PackageLoader("serpentail_codegen"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def render(template: str, data: dict) -> str:
    """Render one template."""
    return environment().get_template(template).render(data)

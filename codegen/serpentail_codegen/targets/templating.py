"""Renders templates by Jinja2; a target has its own in the folder `templates` of its package."""

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined, pass_context

from .expressions import literal


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

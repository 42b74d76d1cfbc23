"""Jinja2, set up once for each target: renders the templates in the target's own folder."""

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined


@cache
def environment(target: str) -> Environment:
    """Return the environment of a target's templates; an undefined name in a template is an
    error.
    """
    return Environment(
        loader=PackageLoader(f"serpentail_codegen.targets.{target}"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def render(target: str, template: str, data: dict) -> str:
    """Render one template of a target."""
    return environment(target).get_template(template).render(data)

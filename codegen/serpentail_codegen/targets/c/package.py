"""The package around a model's C: the files that build, explain and license it."""

from ..templating import render

TEMPLATES = {
    "Makefile": "package/makefile.jinja",
    "CMakeLists.txt": "package/cmake.txt.jinja",
    "LICENSE": "package/license.txt.jinja",
    "README.md": "package/readme.md.jinja",
}


def package_files(context: dict) -> dict[str, str]:
    """Render the files that a user of the C alone needs besides it."""
    context = context | {"size": {"float": 4, "double": 8}[context["real"]]}
    return {name: render("c", template, context) for name, template in TEMPLATES.items()}

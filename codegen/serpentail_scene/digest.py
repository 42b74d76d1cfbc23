"""What generated text depends on besides its scene: the generator, and the tools that it uses."""

import hashlib
import os
import sys
from importlib.util import find_spec

GENERATOR = "serpentail_codegen"
TOOLS = ("sympy", "jinja2")  # packages: another version of one may print another text


def generator_digest() -> str:
    """Return a digest of the generator and its tools; ModuleNotFoundError names what is missing."""
    digest = hashlib.sha256(sys.version.encode())
    for tool in TOOLS:
        digest.update(installed(tool).encode())
    for home in (_home(GENERATOR), os.path.dirname(__file__)):
        for folder, folders, names in os.walk(home):
            folders.sort()
            for name in sorted(n for n in names if n.endswith((".py", ".jinja"))):
                with open(os.path.join(folder, name), "rb") as file:
                    content = file.read()
                digest.update(repr((folder[len(home) :], name, len(content))).encode() + content)
    return digest.hexdigest()


def installed(tool: str) -> str:
    """Return a package's name and version as installed; importlib.metadata would take 30 ms."""
    names = os.listdir(os.path.dirname(_home(tool)))
    return repr(sorted(n for n in names if n.startswith(f"{tool}-") and n.endswith("-info")))


def _home(package: str) -> str:
    """Return the folder of a package."""
    found = find_spec(package)
    if found is None or found.origin is None:
        raise ModuleNotFoundError(f"no package {package}", name=package)
    return os.path.dirname(found.origin)

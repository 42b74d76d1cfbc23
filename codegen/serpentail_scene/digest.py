"""What generated text depends on besides its scene: the generator, and the tools that it uses."""

import hashlib
import json
import sys
from importlib.util import find_spec
from pathlib import Path

GENERATOR = "serpentail_codegen"
TOOLS = ("sympy", "jinja2")  # packages: another version of one may print another text


def generator_digest() -> str:
    """Return a digest of the generator and its tools; ModuleNotFoundError names what is missing."""
    homes = (_home(GENERATOR), Path(__file__).parent)
    sources = [
        [str(path.relative_to(home)), hashlib.sha256(path.read_bytes()).hexdigest()]
        for home in homes
        for path in sorted(home.rglob("*"))
        if path.suffix in (".py", ".jinja")
    ]
    tools = [sys.version, *(name for tool in TOOLS for name in _installed(tool))]
    return hashlib.sha256(json.dumps([tools, sources]).encode()).hexdigest()


def _installed(tool: str) -> list[str]:
    """Return a package's name and version; importlib.metadata would take 30 ms for this."""
    return sorted(path.name for path in _home(tool).parent.glob(f"{tool}-*-info"))


def _home(package: str) -> Path:
    """Return the folder of a package."""
    found = find_spec(package)
    if found is None or found.origin is None:
        raise ModuleNotFoundError(f"no package {package}", name=package)
    return Path(found.origin).parent

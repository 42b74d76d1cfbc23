"""Scenes that come with the package, and where a scene of a name or a path is."""

from os import PathLike
from pathlib import Path
from typing import Any

from ..checks import did_you_mean, shown
from ..errors import SerpentailError
from .source import tables_of

PACKAGE = Path(__file__).parents[1] / "examples"  # of a wheel
CHECKOUT = Path(__file__).parents[3] / "scenes"


def examples() -> dict[str, str]:
    """Return the names of the scenes that come with the package, and what each is.

    Wherever a scene file is asked for, such a name will do: ``st.scenario("kick")``,
    ``st.build("kick")``, ``serpentail simulate kick``.
    """
    return {
        name: str(tables_of(path).get("description", "")) for name, path in example_paths().items()
    }


def example_paths() -> dict[str, Path]:
    """Return the paths of these scenes by their names; none of them is read."""
    return {path.stem: path for path in sorted(_folder().glob("*.toml"))}


def scene_path(scene: str | PathLike[str]) -> Path:
    """Return the path of a scene file, or of the example of that name where there is no such file.

    SerpentailError where it is neither.
    """
    try:
        path = Path(scene)
    except TypeError:
        raise SerpentailError(
            f"scene file: value {shown(scene)}: needs a path, or the name of an example"
        ) from None
    if path.suffix or len(path.parts) != 1 or path.exists():
        return path
    known = example_paths()
    if str(path) in known:
        return known[str(path)]
    remedy = did_you_mean(str(path), known) or f"the examples are {', '.join(known)}"
    raise SerpentailError(
        f"scene file: value {shown(str(path))}: is no file, and no example; {remedy}"
    )


def tables_of_scene(scene: str | PathLike[str]) -> tuple[dict[str, Any], Path]:
    """Return the tables of a scene file or example, and its path.

    SerpentailError where it cannot be read.
    """
    path = scene_path(scene)
    try:
        return tables_of(path), path
    except ValueError as reason:
        raise SerpentailError(f"scene file: value {shown(str(path))}: {reason}") from reason


def _folder() -> Path:
    """Return where the examples are: in an installed package, else in the checkout."""
    return PACKAGE if PACKAGE.is_dir() else CHECKOUT

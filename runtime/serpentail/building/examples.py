"""Example scenes of the package, and the paths of scenes by name."""

from os import PathLike
from pathlib import Path
from typing import Any

from serpentail_scene.source import tables_of

from ..basics.checks import did_you_mean, shown
from ..basics.errors import SerpentailError

PACKAGE = Path(__file__).parents[1] / "examples"  # of a wheel
CHECKOUT = Path(__file__).parents[3] / "scenes"


def examples() -> dict[str, str]:
    """Return the example scenes that come with the package.

    Returns
    -------
    dict of str to str
        Name and description of each scene.

    Notes
    -----
    Wherever a scene file is expected, such a name is accepted too: ``st.scenario("kick")``,
    ``st.build("kick")``, ``serpentail simulate kick``.

    Examples
    --------
    >>> import serpentail as st
    >>> "kick" in st.examples()
    True
    """
    return {
        name: str(tables_of(path).get("description", "")) for name, path in example_paths().items()
    }


def example_paths() -> dict[str, Path]:
    """Return the paths of the example scenes by name; no file is read."""
    folder = PACKAGE if PACKAGE.is_dir() else CHECKOUT
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def scene_path(scene: str | PathLike[str]) -> Path:
    """Return the path of a scene file, or of the example of that name.

    SerpentailError if neither exists.
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
    listed = f"`serpentail examples` lists {len(known)}, such as kick"
    remedy = did_you_mean(str(path), known) or listed
    raise SerpentailError(
        f"scene file: value {shown(str(path))}: is neither a file nor an example; {remedy}"
    )


def tables_of_scene(scene: str | PathLike[str]) -> tuple[dict[str, Any], Path]:
    """Return the tables of a scene file or example, and its path.

    SerpentailError if it cannot be read.
    """
    path = scene_path(scene)
    try:
        return tables_of(path), path
    except ValueError as reason:
        raise SerpentailError(f"scene file: value {shown(str(path))}: {reason}") from reason

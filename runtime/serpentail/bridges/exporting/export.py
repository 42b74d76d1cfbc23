"""``export``: writes a model to a file for another tool."""

import os
from importlib import import_module
from pathlib import Path
from typing import Any

from ...basics.checks import one_of, shown
from ...basics.errors import ExportError
from ...basics.files import refuse_unwritable, replacing
from ...model.chains import refuse_given, refuse_several
from ...model.checked import checked_model
from ...model.model import Model
from .bundle import name_of

SUFFIXES = {  # the first of a kind is the usual one
    "urdf": (".urdf",),
    "mjcf": (".xml", ".mjcf"),
    "bundle": (".zip", ".bundle"),
    "fmu": (".fmu",),
}
SEPARATORS = ("/", os.sep)


def export(model: Model, kind: str, path: str | os.PathLike[str] | None = None) -> Path:
    """Write a model, with its present parameters, to a file for another tool.

    Parameters
    ----------
    model : Model
        The model.
    kind : {"urdf", "mjcf", "bundle", "fmu"}
        "urdf" and "mjcf": articulated tails only; the joints of a segment are coupled by mimic
        joints (URDF) or equality constraints (MJCF). "bundle": a .zip of the generated folder,
        for ``load`` on another machine. "fmu": FMI 2.0.
    path : str or path, optional
        The file, ending in .urdf, .xml, .mjcf, .zip, .bundle or .fmu. Default: the model's name in
        the working folder; a bundle's name includes its hash.

    Returns
    -------
    Path
        The path of the file, which is written whole or not at all.

    Raises
    ------
    ExportError
        An argument is wrong, or the format cannot hold the model.
    NotWritten
        The file cannot be written.
    ModelError
        The scene left out a function that the format needs.

    Examples
    --------
    >>> st.export(model, "mjcf", "rat.xml")  # doctest: +SKIP
    """
    one_of("kind", kind, SUFFIXES, ExportError)
    refuse_given(checked_model(model, ExportError), "export")
    if kind == "fmu":
        remedy = 'export an "mjcf" or a "bundle", or a scene without tables [chain.NAME]'
        refuse_several(model, f"kind: value {kind!r}", remedy, ExportError)
    name = name_of(model) if kind == "bundle" else model.name
    target = checked_path(kind, f"{name}{SUFFIXES[kind][0]}" if path is None else path)
    content: bytes = getattr(import_module(f".{kind}", __package__), kind)(model)
    with replacing(target) as part:
        part.write_bytes(content)
    return target


def xml_file(root: Any) -> bytes:
    """Return an element of XML, and what is in it, as a file."""
    from xml.etree import ElementTree as Xml

    Xml.indent(root)
    return bytes(Xml.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def checked_path(kind: str, path: Any) -> Path:
    """Return the path of a file of a kind.

    ExportError if its name is wrong, or if it cannot be written.
    """
    try:
        target = Path(path)
        named = target.suffix.lower() in SUFFIXES[kind] and "\0" not in target.name
        if not named or os.fspath(path).endswith(SEPARATORS):
            raise ValueError(f"needs a file whose name ends in {' or '.join(SUFFIXES[kind])}")
        refuse_unwritable(target)
    except (TypeError, ValueError) as error:
        raise ExportError(f"path: value {shown(path)}: {error}") from error
    except OSError as error:
        raise ExportError(f"path: value {shown(path)}: {error}: name another file") from error
    return target

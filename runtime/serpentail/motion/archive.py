"""Files of motions, and what a motion says of the model that made it.

A file is one npz of arrays, which is read only if every checksum is right.
"""

import json
import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np

from ..basics.files import replacing
from ..model.model import Model
from ..model.parameters import json_ready
from .contact import Contact

SUFFIX = ".npz"
T = TypeVar("T")
CONTACT = "contact_"  # before the names of a contact's arrays in a file
NAMES = "coordinates"  # in info: names of those of several chains
MOST_EXPANSION = 100  # times the file: ours is not compressed, a motion in one that is fits, too


def write(
    path: str | os.PathLike[str],
    arrays: Mapping[str, Any],
    info: Mapping[str, Any],
    contact: Contact | None,
) -> Path:
    """Write one npz file, whole or not at all; return its path. NotWritten if it cannot be."""
    target = _npz(path)
    touching: dict[str, Any] = {}
    if contact is not None:
        touching = {CONTACT + name: array for name, array in contact.arrays.items()}
        touching[CONTACT + "groups"] = np.array(json.dumps(contact.groups))
    with replacing(target) as part, part.open("wb") as stream:
        np.savez(stream, info=np.array(json.dumps(info)), **arrays, **touching)
    return target


def read(path: str | os.PathLike[str], arrays: Iterable[str], kind: type[T]) -> T:
    """Return the trajectory of a file, made by its class.

    FileNotFoundError if it is absent, ValueError if it is not a trajectory.
    """
    source = _npz(path)
    if not source.is_file():
        raise FileNotFoundError(
            f"no trajectory file {str(source)!r}: check the name, or save one first"
        )
    fields = _stored(source, arrays)
    try:
        return kind(**_parsed(fields))
    except (KeyError, RecursionError, TypeError, ValueError) as error:
        raise ValueError(f"{str(source)!r} does not hold a valid trajectory: {error}") from error


def _npz(path: str | os.PathLike[str]) -> Path:
    """The path with the suffix .npz; "." and "/", which name no file, stay as they are."""
    path = Path(path)
    complete = path.suffix == SUFFIX or not path.name
    return path if complete else path.with_name(path.name + SUFFIX)


def _stored(source: Path, arrays: Iterable[str]) -> dict[str, Any]:
    """The fields of a trajectory file, as stored, after a check of every checksum."""
    with source.open("rb") as stream:
        try:
            return _checked(stream, source.stat().st_size, (*arrays, "info"))
        except KeyError as error:
            raise ValueError(f"{str(source)!r} is not a trajectory: {error.args[0]}") from error
        except Exception as error:  # zip and NumPy raise a dozen kinds for damaged bytes
            raise ValueError(
                f"{str(source)!r} is damaged or not a trajectory ({error}): save it again"
            ) from error


def _checked(stream: BinaryIO, size: int, needed: Iterable[str]) -> dict[str, Any]:
    """The fields of a file of so many bytes, and those of a contact."""
    with zipfile.ZipFile(stream) as archive:
        unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > MOST_EXPANSION * size:
            raise ValueError(f"it would unpack to {unpacked / 1e9:.2g} GB")
        damaged = archive.testzip()
    if damaged:
        raise ValueError(f"the checksum of {damaged!r} is wrong")
    stream.seek(0)
    with np.load(stream, allow_pickle=False) as stored:
        touching = [name for name in stored.files if name.startswith(CONTACT)]
        return {name: stored[name] for name in (*needed, *touching)}


def _parsed(fields: dict[str, Any]) -> dict[str, Any]:
    """The arguments of a trajectory from the fields of a file."""
    arguments, touching = {}, {}
    for name, value in fields.items():
        if name.startswith(CONTACT):
            touching[name.removeprefix(CONTACT)] = value
        else:
            arguments[name] = value
    if touching:
        groups = json.loads(str(touching.pop("groups")))
        arguments["contact"] = Contact(**touching, groups=groups)
    return arguments | {"info": json.loads(str(fields["info"]))}


def origin(model: Model) -> dict[str, Any]:
    """Return name, hashes and parameters of a model, ready for JSON; of several chains the names
    of their coordinates.
    """
    several = len(model.layout.chains) > 1
    return {
        "model": model.name,
        "content_hash": model.manifest["content_hash"],
        "manifest_hash": model.checked.manifest_hash,
        "parameters": json_ready(model.parameters),
    } | ({NAMES: list(model.names.tail)} if several else {})

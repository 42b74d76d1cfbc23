"""Private copies of generated folders in the cache, from which alone models are compiled."""

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path, PurePosixPath

from ..basics.errors import ModelError, SerpentailError
from ..compiling.cache import (
    MODELS,
    cache_folder,
    mark_used,
    publish,
    refuse_others,
    unwritable,
    workshop,
)
from ..compiling.compiler import library_of, noted, text_digest
from ..compiling.safe_files import regular_bytes
from .manifest import CheckedFolder, read_folder


def model_library(checked: CheckedFolder, sources: Sequence[str], profile: str) -> Path:
    """Return the library of some of a model's sources; errors as of ``compile_library``."""
    cache = cache_folder(None)

    def places() -> tuple[list[Path], Path]:
        folder = snapshot(checked, cache)
        return [folder / name for name in sources], folder / "include"

    return library_of(_text(checked, sources), places, profile, cache)


def library_in_cache(checked: CheckedFolder, sources: Sequence[str], profile: str) -> Path | None:
    """Return the library of ``model_library`` if it is in the cache, else None."""
    return noted(_text(checked, sources), profile, cache_folder(None))


def _text(checked: CheckedFolder, sources: Sequence[str]) -> str:
    """Return the digest of sources, and of the headers that they can include."""
    digests = checked.manifest["files"]
    paths = [PurePosixPath(name) for name in digests]
    headers = [path for path in paths if path.suffix == ".h"]
    beside = {PurePosixPath(name).parent for name in sources}
    return text_digest(
        [(PurePosixPath(name).name, digests[name]) for name in sources],
        [
            *(
                (p.relative_to("include").as_posix(), digests[str(p)])
                for p in headers
                if p.parts[0] == "include"
            ),
            *((f"./{p.name}", digests[str(p)]) for p in headers if p.parent in beside),
        ],
    )


def snapshot(checked: CheckedFolder, cache: Path) -> Path:
    """Return the folder in the cache with exactly a model's files; make it if needed.

    SerpentailError if it cannot be written.
    """
    place = cache / MODELS / checked.manifest_hash
    content = contents(checked)
    try:
        if not _holds(place, content):
            with workshop(cache) as part:
                (part / "model").mkdir(0o700)
                for name, text in content.items():
                    path = part / "model" / name
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_bytes(text)
                publish(part / "model", place, lambda place: _holds(place, content))
    except OSError as error:
        raise unwritable(cache, error) from error
    mark_used(place)
    return place


def restored(manifest_hash: str, folder: Path) -> CheckedFolder:
    """Return the model with a manifest's hash, from the cache or else from its folder.

    ModelError if neither has it.
    """
    with suppress(SerpentailError):
        place = cache_folder(None) / MODELS / manifest_hash
        refuse_others(place.parents[1], place.parent, place)
        found = read_folder(place)
        if found.manifest_hash == manifest_hash:
            mark_used(place)
            return replace(found, folder=folder)
    found = read_folder(folder)
    if found.manifest_hash != manifest_hash:
        raise ModelError(
            f"{folder} was generated again since the model was pickled (its manifest was "
            f"{manifest_hash:.12}, now {found.manifest_hash:.12}), and the cache no longer has "
            "the pickled one: generate it again as it was, or load and pickle the model anew"
        )
    return found


def contents(checked: CheckedFolder) -> dict[str, bytes]:
    """Return the files of a snapshot; equal manifests, however laid out, give the same text."""
    return {**checked.files, "manifest.json": json.dumps(checked.manifest, sort_keys=True).encode()}


def _holds(place: Path, content: dict[str, bytes]) -> bool:
    """Tell whether a folder has these files and no others."""
    refuse_others(place)
    try:
        names = {p.relative_to(place).as_posix() for p in place.rglob("*") if not p.is_dir()}
        return names == content.keys() and all(
            regular_bytes(place / name) == text for name, text in content.items()
        )
    except OSError:
        return False

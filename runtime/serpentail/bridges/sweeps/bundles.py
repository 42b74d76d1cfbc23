"""Models that are sent to workers: a hashed bundle of the generated folder, unpacked and compiled
once for each machine.
"""

import io
import zipfile
import zlib
from collections import OrderedDict
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from ...basics.errors import SerpentailError
from ...compiling.cache import MODELS, cache_folder, refuse_others, workshop
from ...model.load import model_from
from ...model.manifest import CheckedFolder, read_folder
from ...model.model import Model
from ...model.snapshot import contents, snapshot
from ..exporting.bundle import zipped
from .job import Job

MOST_MODELS = 64  # that a process keeps


@dataclass(frozen=True)
class Bundle:
    """A model's generated folder: the hash of its manifest, and its files, compressed."""

    manifest_hash: str
    content: bytes

    @classmethod
    def of(cls, checked: CheckedFolder) -> "Bundle":
        """Return the bundle of a folder that was checked."""
        return cls(checked.manifest_hash, zlib.compress(zipped(contents(checked))))


_models: OrderedDict[tuple[str, str], Model] = OrderedDict()


def model_of(bundle: Bundle | None, job: Job) -> Model | None:
    """Return the model of a bundle for a job, compiled if this machine has not yet done so."""
    if bundle is None:
        return None
    key = bundle.manifest_hash, job.identity()
    if key not in _models:
        changes: dict[str, Any] | None = dict(job.parameters) or None
        _models[key] = model_from(unpacked(bundle), changes, job.profile)
        if len(_models) > MOST_MODELS:
            _models.popitem(last=False)
    return _models[key]


def unpacked(bundle: Bundle) -> CheckedFolder:
    """Return the folder of a bundle in this machine's cache; unpack it if it is missing."""
    cache = cache_folder(None)
    place = cache / MODELS / bundle.manifest_hash
    with suppress(SerpentailError):
        refuse_others(cache, place.parent, place)
        found = read_folder(place)
        if found.manifest_hash == bundle.manifest_hash:
            return found
    with workshop(cache) as part:
        with zipfile.ZipFile(io.BytesIO(zlib.decompress(bundle.content))) as archive:
            archive.extractall(part)
        found = read_folder(part)
        return replace(found, folder=snapshot(found, cache))

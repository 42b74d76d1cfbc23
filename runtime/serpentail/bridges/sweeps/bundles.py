"""Models that are sent to workers: a hashed bundle of the generated folder, unpacked and compiled
once for each machine.
"""

import io
import zipfile
import zlib
from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Any

from ...compiling.cache import cache_folder, workshop
from ...model.load import model_from
from ...model.manifest import CheckedFolder, in_cache, read_folder, snapshot
from ...model.model import Model
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
        return cls(checked.manifest_hash, zlib.compress(zipped(checked.contents())))


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
    cache = cache_folder()
    found = in_cache(bundle.manifest_hash, cache)
    if found:
        return found
    with workshop(cache) as part:
        with zipfile.ZipFile(io.BytesIO(zlib.decompress(bundle.content))) as archive:
            archive.extractall(part)
        found = read_folder(part)
        return replace(found, folder=snapshot(found, cache))

"""The generated folder of a model in one file, for another machine."""

import io
import zipfile

from ...basics.checks import shown
from ...basics.errors import ExportError
from ...model.model import Model
from ...model.parameters import resolve

BEGINNING = (1980, 1, 1, 0, 0, 0)  # earliest time of a zip: no real date is stored
RIGHTS = 0o100644 << 16  # a plain file that all may read
UNIX = 3  # whose rights they are


def bundle(model: Model) -> bytes:
    """Return the file: a folder that ``st.load`` takes, named by the model and its content's hash.

    Equal models have equal bytes. ExportError if the parameters are not the scene's, because the
    folder holds only those.
    """
    defaults = resolve(model.manifest, None)
    for name, value in model.parameters.items():
        if value != defaults.get(name):
            raise ExportError(
                f"{name}: value {shown(value)}: a bundle has the scene's, "
                f"{shown(defaults.get(name))}: write it below [parameters] of a scene file and "
                "export that, or export st.load(folder) and change what st.load makes of it there"
            )
    return zipped({f"{name_of(model)}/{n}": x for n, x in model.checked.contents().items()})


def name_of(model: Model) -> str:
    """Return the name of a model and of its content."""
    return f"{model.name}-{model.checked.manifest_hash[:16]}"


def zipped(files: dict[str, bytes]) -> bytes:
    """Return a zip of files by name.

    It is not compressed, because versions of zlib compress differently.
    """
    archived = io.BytesIO()
    with zipfile.ZipFile(archived, "w", zipfile.ZIP_STORED) as archive:
        for name, content in sorted(files.items()):
            entry = zipfile.ZipInfo(name, BEGINNING)
            entry.external_attr, entry.create_system = RIGHTS, UNIX
            archive.writestr(entry, content)
    return archived.getvalue()

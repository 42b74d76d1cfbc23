"""Files that are written whole or not at all."""

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from .errors import NotWritten


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Lend a file to write, which replaces path on success and is removed on failure; NotWritten
    where the system refuses.
    """
    target = Path(path)
    part = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(target)
    except OSError as reason:
        raise NotWritten(
            f"{str(target)!r} is not written ({reason.strerror or reason}): make room, or give the "
            "name of a file that may be written"
        ) from reason
    finally:
        with contextlib.suppress(OSError):  # where there is no folder for it
            part.unlink(missing_ok=True)

"""Reads scene files as data: regular files of bounded size, with keys of bounded depth."""

import re
import tomllib
from pathlib import Path
from typing import Any

MOST_BYTES = 1_000_000
MOST_DOTS = 100  # in a line, besides those of numbers: the parser's work grows as their square
DECIMAL = re.compile(r"(?<![\w.])\d[\d_]*\.\d[\d_]*(?:[eE][+-]?\d+)?(?![\w.])")


def tables_of(path: Path) -> dict[str, Any]:
    """Return the tables of a scene file; ValueError gives the reason and the remedy."""
    try:
        return tables_in(_text(path))
    except OSError as error:
        reason = f"cannot be read: {error.strerror}; give the path of a scene file (.toml)"
    except UnicodeDecodeError as error:
        reason = f"not UTF-8 from byte {error.start} on; save it as UTF-8 text"
    except (ValueError, RecursionError) as error:  # of the parser, or for a NUL in the path
        reason = f"cannot be read as TOML: {error}"
    raise ValueError(reason)


def _text(path: Path) -> str:
    """Return the text of a regular file of a bounded size."""
    # opening a pipe would wait for its other end, reading a device would never end
    if path.exists() and not path.is_file():
        raise OSError(0, "no regular file")
    with path.open("rb") as stream:
        content = stream.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise OSError(0, f"larger than {MOST_BYTES // 1_000_000} MB")
    return content.decode("utf-8-sig")


def tables_in(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text; ValueError or RecursionError if it is invalid."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.count(".") > MOST_DOTS and DECIMAL.sub("", line).count(".") > MOST_DOTS:
            raise ValueError(f"more than {MOST_DOTS} dots in line {number}; no key is so deep")
    return tomllib.loads(text)

"""Reads the data of a page, and skips tests if the page is missing."""

import base64
import gzip
import json
import os
import struct
from pathlib import Path

import numpy as np
import pytest

from checks.embedded.boards import ToolchainMissing
from serpentail.show.page import view


def need_page() -> None:
    """Raise ToolchainMissing if the page was not built."""
    if not view.PAGE.exists():
        raise ToolchainMissing("the page of runs was not built; install Node.js 18, `make setup`")


def need(check) -> None:
    """Skip a test if something is missing, with the reason; in CI it fails."""
    try:
        check()
    except ToolchainMissing as error:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(str(error))


def data_of(page: Path) -> dict:
    """The data of a page, its arrays (rows, columns) as float32."""
    text = page.read_text(encoding="utf-8")
    begin = text.index('id="data">') + len('id="data">')
    data = json.loads(text[begin : text.index("</script>", begin)])
    for run in data["runs"]:
        arrays = run["arrays"].items()
        run["arrays"] = {name: _floats(packed, run["rows"]) for name, packed in arrays}
    return data


def _floats(packed: str, rows: int) -> np.ndarray:
    """Columns of floats: four planes of bytes, of differences between bits of following rows."""
    planes = gzip.decompress(base64.b64decode(packed))
    count, values, bits = len(planes) // 4, [], 0
    for i in range(count):
        step = int.from_bytes(bytes(planes[plane * count + i] for plane in range(4)), "little")
        bits = (step + (bits if i % rows else 0)) % 2**32
        values.append(struct.unpack("<f", struct.pack("<I", bits))[0])
    return np.array(values, np.float32).reshape(-1, rows).T

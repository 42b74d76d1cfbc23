"""The generator emits the same files for every model of the zoo that is no tree as it did before.

A change that is for other models must not touch these.  One that is meant for them is accepted by
``python -m pytest tests/house/test_bytes.py --update-golden``.
"""

import hashlib
import json
from pathlib import Path

import pytest

from tests.support import zoo

DIGESTS = Path(__file__).with_name("emitted.json")


def digest(folder):
    """A digest of all files of a generated folder and of their names, but not of traces of use."""
    content = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder)
        if not {"build", "__pycache__"} & {*name.parts}:
            content.update(name.as_posix().encode() + b"\0" + path.read_bytes())
    return content.hexdigest()[:16]


@pytest.mark.slow  # where no other test has made the models
def test_models_have_the_same_bytes_as_before(request):
    alone = [name for name, tables in zoo.ZOO.items() if "chain" not in tables]
    emitted = {name: digest(zoo.folder(name)) for name in alone}
    if request.config.getoption("--update-golden"):
        DIGESTS.write_text(json.dumps(emitted, indent=2) + "\n")
    before = json.loads(DIGESTS.read_text())
    assert emitted.keys() == before.keys()
    assert [name for name in alone if emitted[name] != before[name]] == []

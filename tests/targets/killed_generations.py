"""Kills a generation at each of its calls of the file system: `killed_generations FOLDER OLD NEW`.

It prints how many calls there are, and how often which model was left.  After each kill the
runtime reads the old or the new model, its user's files are there, and the next generation leaves
nothing else.
"""

import itertools
import json
import os
import sys
from pathlib import Path

from serpentail.model.manifest import read_folder
from serpentail_codegen.targets import exchange
from serpentail_codegen.targets.write import write_folder
from tests.support.file_faults import age, killed_at


def texts(source):
    """The texts and the manifest of a generated folder."""
    checked = read_folder(source)
    return {name: text.decode() for name, text in checked.files.items()}, checked.manifest


def main(folder, old, new):
    """Kill a generation of the new model over the old one, at each call."""
    before, after, mine = texts(old), texts(new), folder / "build" / "mine.o"
    hashes = [manifest["manifest_hash"] for _, manifest in (before, after)]
    left = [0, 0]
    for moment in itertools.count():
        write_folder(folder, *before)
        mine.parent.mkdir(exist_ok=True)
        mine.write_text("mine")
        killed = killed_at(moment, lambda: write_folder(folder, *after), (exchange, "_exchanged"))
        left[hashes.index(read_folder(folder).manifest_hash)] += 1
        assert mine.read_text() == "mine", moment

        age(folder.parent)
        write_folder(folder, *after)
        assert os.listdir(folder.parent) == [folder.name], moment
        assert read_folder(folder).manifest_hash == hashes[1], moment
        assert {*os.listdir(folder)} == {*os.listdir(new), "build"}, moment
        if not killed:
            print(json.dumps({"moments": moment, "old": left[0], "new": left[1]}))
            return


if __name__ == "__main__":
    os.fsync = lambda _: None  # a kill loses nothing that was written
    main(*map(Path, sys.argv[1:]))

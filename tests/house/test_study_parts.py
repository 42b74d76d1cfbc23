"""Parts of studies: kept files are read, and made anew exactly where what they depend on has
changed.
"""

import numpy as np
import pytest

from examples.studies.parts import as_flight, as_lists, digest, part
from tests.support.tumbling import planned


def test_parts_are_made_once(tmp_path):
    path, made = tmp_path / "parts" / "one.json", []

    def make():
        made.append(len(made))
        return {"rows": made, "lost": float("nan")}

    first, again = (part(path, {"starts": (1, 2)}, make) for _ in range(2))
    assert first["rows"] == again["rows"] == [0] and np.isnan(again["lost"])
    assert part(path, {"starts": (1, 3)}, make)["rows"] == [0, 1]
    path.write_text(path.read_text()[:-9])
    assert part(path, {"starts": (1, 3)}, make)["rows"] == [0, 1, 2]
    assert list(path.parent.iterdir()) == [path]


def test_a_part_that_fails_leaves_no_file(tmp_path):
    with pytest.raises(ZeroDivisionError):
        part(tmp_path / "one.json", {}, lambda: 1 / 0)
    assert not list(tmp_path.iterdir())


def test_digests_follow_the_sources(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    before = digest(tmp_path)
    (tmp_path / "notes.md").write_text("words")
    assert digest(tmp_path) == before
    (tmp_path / "a.py").write_text("x = 2\n")
    assert digest(tmp_path) != before


def test_flights_come_back_bit_for_bit():
    flight = planned(tolerance=None, intervals=8).trajectory
    again = as_flight(as_lists(flight))
    for name in as_lists(flight):
        np.testing.assert_array_equal(getattr(again, name), getattr(flight, name))

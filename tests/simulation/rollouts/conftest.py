"""Rollouts: many runs at once give what each gives alone, bit for bit, its error too, in any order,
on any core.
"""

import pytest

from serpentail.simulation import parallel_runs

# Flights abreast: by rk4, lanes of vectors.


@pytest.fixture
def any_number_is_many(monkeypatch):
    monkeypatch.setattr(parallel_runs, "worth_batching", lambda *_: True)

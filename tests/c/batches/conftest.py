"""Batches: states side by side give what each of them gives alone, in any number, from any thread,
errors included.
"""

import pytest


@pytest.fixture(autouse=True)
def any_batch_is_large(monkeypatch):
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1)

"""A worker that sweeps share: its process, which takes long to begin, goes on to the next one."""

from concurrent.futures import ThreadPoolExecutor

import pytest


@pytest.fixture(scope="session")
def worker():
    with ThreadPoolExecutor(1) as executor:
        yield executor

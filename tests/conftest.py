"""Options of the test run, and where its compiled models are kept."""

import os

from tests.support.models import BUILD

# One cache for all processes and runs, which is not the developer's own.
os.environ["SERPENTAIL_CACHE"] = str(BUILD / "cache")


def pytest_addoption(parser):
    """Add the switch that accepts what the generator emits now as the golden models."""
    parser.addoption(
        "--update-golden", action="store_true", help="rewrite generated/golden_* from the generator"
    )

"""Options of the test run."""


def pytest_addoption(parser):
    """Add the switch that accepts what the generator emits now as the golden models."""
    parser.addoption(
        "--update-golden", action="store_true", help="rewrite generated/golden_* from the generator"
    )

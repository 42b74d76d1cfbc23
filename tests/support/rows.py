"""Tables inside tests: a failure names the row that it is of."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def row(*names: object) -> Iterator[None]:
    """Add the name of a row to whatever fails inside."""
    try:
        yield
    except BaseException as error:
        error.add_note(f"row: {', '.join(map(str, names))}")
        raise

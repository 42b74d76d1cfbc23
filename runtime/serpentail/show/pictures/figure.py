"""The figure that drawings are made on; Matplotlib is imported with it, so ask for it late."""

import io
from typing import Any

from matplotlib import style
from matplotlib.figure import Figure

from .style import STYLE


class Drawing(Figure):
    """A figure that a notebook shows, whether pyplot is loaded or not."""

    def draw(self, renderer: Any) -> None:
        """Draw it in the shared style, in which Matplotlib now makes the ticks."""
        with style.context(STYLE, after_reset=True):
            super().draw(renderer)

    def _repr_png_(self) -> bytes:
        drawn = io.BytesIO()
        self.savefig(drawn, format="png")
        return drawn.getvalue()

"""The figure that drawings are made on; Matplotlib is imported with it, so ask for it late."""

import io

from matplotlib.figure import Figure


class Drawing(Figure):
    """A figure that a notebook shows, whether pyplot is loaded or not."""

    def _repr_png_(self) -> bytes:
        drawn = io.BytesIO()
        self.savefig(drawn, format="png")
        return drawn.getvalue()

"""Bytes of pages of 600 samples, seconds until they are ready, and frames a second.

In Chromium, without a graphics processor.
"""

import time
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import built, label
from tests.support.chromium import chromium, opened

SIZES = ((1, 3), (4, 10))
SAMPLES = 600
WATCHED = 4.0  # s
FRAMES = """
  const [watched, done] = arguments, begun = performance.now();
  let frames = 0;
  const count = () => {
    const seconds = (performance.now() - begun) / 1e3;
    if (seconds > watched) return done(frames / seconds);
    frames += 1;
    requestAnimationFrame(count);
  };
  document.getElementById("play").click();
  requestAnimationFrame(count);
"""


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    with chromium() as driver:
        for size in SIZES:
            model = built(*size)
            page = _tumble(model).view(folder / "page.html")
            begun = time.perf_counter()
            opened(driver, page)
            ready = time.perf_counter() - begun
            frames = driver.execute_async_script(FRAMES, WATCHED)
            row = {"model": label(*size), "page, bytes": page.stat().st_size}
            rows.append(row | {"ready, s": ready, "frames a second": frames})
    return rows


def _tumble(model: st.Model) -> st.Trajectory:
    """A flight with a bent tail."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3], q[7::2], v[2], v[3:6] = 1.0, 0.4 / model.links, 2.0, (6.0, 1.0, -2.0)
    step = 0.5 / (SAMPLES - 1)
    return st.simulate(model, q, v, controller=st.Damping(1e-3), t_span=0.5, output_step=step)

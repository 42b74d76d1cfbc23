"""Seconds from nothing to a loaded model.

A new process generates it, and it is compiled into an empty cache.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.models import label

ROOT = Path(__file__).resolve().parents[1]
BUILT = """
import ast, json, sys
import serpentail as st
from benchmarks.models import built
ends = {}
with st.progress(lambda now: ends.update({now.stage: now.seconds})):
    model = built(*ast.literal_eval(sys.argv[1]))
text = model.folder / "src" / f"{model.name}.c"
found = {"generate, s": ends["derive"], "compile, s": ends["compile"]}
found |= {"C, bytes": text.stat().st_size}
print(json.dumps(found | {"emission": model.manifest["functions"]["forward_dynamics"]["emission"]}))
"""


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    for size in ((1, 3), (3, 4), (8, 16), (6, None)):
        empty = os.environ | {"SERPENTAIL_CACHE": str(folder / f"empty_{label(*size)}")}
        command = [sys.executable, "-c", BUILT, repr(size)]
        begun = time.perf_counter()
        done = subprocess.run(command, env=empty, cwd=ROOT, check=True, stdout=subprocess.PIPE)
        total = time.perf_counter() - begun
        rows.append({"model": label(*size)} | json.loads(done.stdout) | {"in all, s": total})
    return rows

"""The example of docs/sweeps.md runs and prints what it says."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_example_runs(tmp_path):
    text = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    command = [sys.executable, "-c", block]
    printed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    said = re.search(r"print\(study.status\(\)\)  # (.*)", block)[1]
    first, second = printed.stdout.splitlines()
    assert first == said and float(second) > 0
    assert {path.name for path in tmp_path.iterdir()} >= {"study.db", "run.html"}

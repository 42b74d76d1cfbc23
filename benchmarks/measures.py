"""Runs measures, each a module of this folder, and reports.

A measure has a docstring, which says what it measures, with units and conditions, and a function
``measured`` of a scratch folder that returns the rows of its table. ``PER_PROCESSOR`` is there and
true if its result depends on the width of vectors, ``PROCESSES`` if it is repeated in as many
processes: then times are the least of all runs, and ratios have a span.
"""

import hashlib
import importlib
import inspect
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from benchmarks.peers import build
from benchmarks.processors import Processor, left_out, march, processor_line, processors
from benchmarks.report import written
from examples.studies.parts import digest
from serpentail.basics.files import replacing
from serpentail.basics.progress import Stage

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ("codegen", "runtime", "benchmarks", "examples/righting.py")
# a run in a process of its own; its arguments: two folders, then names of measures
CHILD = """
import sys
from pathlib import Path
import serpentail as st
from benchmarks.measures import measure
with st.progress():
    measure(sys.argv[3:], *map(Path, sys.argv[1:3]))
"""


def module(name: str) -> ModuleType:
    """Return the module of a measure."""
    return importlib.import_module(f"benchmarks.{name}")


def per_processor(name: str) -> bool:
    """Tell if a measure is made for each processor."""
    return getattr(module(name), "PER_PROCESSOR", False)


def bench(output: Path, names: Sequence[str]) -> dict:
    """Run the named measures, write the report, print and return it.

    What is measured is kept in OUTPUT/measured until the report is written, so that an interrupted
    run resumes if neither the sources nor the machine have changed.
    """
    there = processors()
    kept = output / "measured" / state()
    report: dict = {"machine": machine(there)} | {name: [] for name in names} | {"seconds": []}
    for processor in there:
        wanted = [name for name in names if per_processor(name) or processor is there[0]]
        for name, found in on(processor, wanted, kept / processor.name).items():
            tag = {"processor": processor.name} if per_processor(name) else {}
            report[name].extend(tag | row for row in found["rows"])
            report["seconds"].append({"measure": name} | tag | {"took, s": found["seconds"]})
    print(written(output, report, {name: inspect.getdoc(module(name)) or "" for name in names}))
    for name in names:
        if hasattr(module(name), "draw"):
            module(name).draw(report[name], output / f"{name}.png")
    print(f"written: {output}: report.md, report.json", file=sys.stderr)
    shutil.rmtree(kept.parent)
    return report


def state() -> str:
    """Return a hash of what a measure depends on: sources and processor."""
    sources = digest(*(ROOT / name for name in SOURCES))
    words = f"{sources} {processor_line('model name')} {os.cpu_count()}"
    return hashlib.sha256(words.encode()).hexdigest()[:16]


def on(processor: Processor, names: list[str], kept: Path) -> dict[str, dict]:
    """Return what measures found on a processor; each run has a process of its own."""
    counts = {name: getattr(module(name), "PROCESSES", 1) for name in names}
    for run in range(max(counts.values(), default=0)):
        folder = kept / f"run_{run}"
        folder.mkdir(parents=True, exist_ok=True)
        here = [name for name in names if run < counts[name]]
        if missing := [name for name in here if not (folder / f"{name}.json").exists()]:
            with tempfile.TemporaryDirectory() as scratch:
                command = [sys.executable, "-c", CHILD, scratch, str(folder), *missing]
                subprocess.run(command, cwd=ROOT, env=processor.environment, check=True)
    found = {}
    for name, count in counts.items():
        files = [kept / f"run_{run}" / f"{name}.json" for run in range(count)]
        runs = [json.loads(file.read_text()) for file in files]
        rows = [spanned(rows) for rows in zip(*(run["rows"] for run in runs), strict=True)]
        found[name] = {"rows": rows, "seconds": sum(run["seconds"] for run in runs)}
    return found


def spanned(rows: Sequence[dict]) -> dict:
    """Return one row for those of several runs: least times, spans of ratios, largest errors."""
    row = {}
    for key, value in rows[0].items():
        row[key] = value
        if len(rows) > 1 and isinstance(value, float):
            least, most = (choose(each[key] for each in rows) for choose in (min, max))
            row[key] = most if key in ("difference", "error") else least
            if "ratio" in key:
                row[f"{key}, most"] = most
    return row


def measure(names: Sequence[str], scratch: Path, kept: Path) -> None:
    """Run measures, and keep the rows of each and the seconds that it took."""
    with Stage("bench", march()) as stage:
        for done, name in enumerate(names):
            stage.tell(done / len(names), name)
            begun = time.perf_counter()
            rows = module(name).measured(scratch)
            found = {"rows": rows, "seconds": time.perf_counter() - begun}
            with replacing(kept / f"{name}.json") as part:
                part.write_text(json.dumps(found, default=float))


def machine(there: list[Processor]) -> dict:
    """Return the processor, what stands for which, and the compilers."""
    from serpentail.compiling.compiler import describe_compiler

    columns = [f"{p.name} as {p.level}" if p.level else p.name for p in there]
    return {
        "processor": processor_line("model name") or there[0].name,
        "cores": os.cpu_count(),
        "columns": ", ".join([*columns, *left_out(there)]),
        "compiler": describe_compiler()["version"].splitlines()[0],
        "peers": build.described(),
    }

"""Runs measures, each a module of this folder, and reports.

A measure has a docstring, which says what it measures, with units and conditions, and a function
``measured`` of a scratch folder that returns the rows of its table. ``PER_PROCESSOR`` is there and
true if its result depends on the width of vectors.
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
# a process that uses a lesser processor; its arguments: two folders, then names of measures
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


def bench(output: Path, names: Sequence[str]) -> None:
    """Run the named measures, write the report, and print it.

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


def state() -> str:
    """Return a hash of what a measure depends on: sources and processor."""
    sources = digest(*(ROOT / name for name in SOURCES))
    words = f"{sources} {processor_line('model name')} {os.cpu_count()}"
    return hashlib.sha256(words.encode()).hexdigest()[:16]


def on(processor: Processor, names: list[str], kept: Path) -> dict[str, dict]:
    """Return what measures found on a processor, which a process of its own uses if it is a lesser
    one.
    """
    kept.mkdir(parents=True, exist_ok=True)
    missing = [name for name in names if not (kept / f"{name}.json").exists()]
    with tempfile.TemporaryDirectory() as scratch:
        if missing and processor.level is None:
            measure(missing, Path(scratch), kept)
        elif missing:
            command = [sys.executable, "-c", CHILD, scratch, str(kept), *missing]
            subprocess.run(command, cwd=ROOT, env=processor.environment, check=True)
    return {name: json.loads((kept / f"{name}.json").read_text()) for name in names}


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

"""What `make bench` measures, in this order, and the report of one run of it."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks import (
    batches,
    callers,
    contact_costs,
    contact_shares,
    continuum_forms,
    derivatives,
    environments,
    ground_lanes,
    identification,
    long_tails,
    meshes,
    nodes,
    operations,
    pages,
    peak,
    planning,
    precisions,
    processors,
    scaling,
    simulations,
    solvers,
    speeds,
)
from benchmarks.peers import compilers
from benchmarks.peers import mujoco_casadi as more_peers
from benchmarks.peers import soromox as continuum_peer
from benchmarks.report import written
from examples.studies.parts import digest
from serpentail.basics.files import replacing
from serpentail.basics.progress import Stage

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ("codegen", "runtime", "benchmarks", "examples/righting.py")


class Measure(NamedTuple):
    """The function that gives the rows of a table; each: once for each processor."""

    rows: Callable[[Path], list[dict]]
    each: bool = False


MEASURES = {
    "peak": Measure(peak.peaks, True),
    "speed": Measure(speeds.speed, True),
    "other_peers": Measure(more_peers.other_peers, True),
    "jacobian_times": Measure(derivatives.jacobian_times, True),
    "hessian_times": Measure(derivatives.hessian_times, True),
    "batch_times": Measure(batches.batch_times, True),
    "node_times": Measure(nodes.node_times, True),
    "mesh_times": Measure(meshes.mesh_times, True),
    "stage_times": Measure(meshes.stage_times),
    "long_times": Measure(long_tails.long_times, True),
    "call_times": Measure(callers.call_times, True),
    "flight_times": Measure(callers.flight_times, True),
    "rollout_rates": Measure(batches.rollout_rates, True),
    "environment_rates": Measure(environments.environment_rates, True),
    "ground_batch_times": Measure(ground_lanes.ground_batch_times, True),
    "ground_step_times": Measure(ground_lanes.ground_step_times, True),
    "operation_counts": Measure(operations.operation_counts),
    "generation": Measure(speeds.generation),
    "derivative_code": Measure(derivatives.derivative_code),
    "scaling": Measure(scaling.scaling),
    "tails": Measure(speeds.tails),
    "continuum_peer": Measure(continuum_peer.continuum_peer),
    "precision_times": Measure(precisions.precision_times),
    "drift": Measure(speeds.drift),
    "work_precision": Measure(speeds.work_precision),
    "simulation_summary": Measure(simulations.simulation_summary),
    "simulation_times": Measure(simulations.simulation_times),
    "mujoco_times": Measure(simulations.mujoco_times),
    "contact_costs": Measure(contact_costs.contact_costs),
    "contact_shares": Measure(contact_shares.contact_shares),
    "continuum_forms": Measure(continuum_forms.form_errors),
    "continuum_form_times": Measure(continuum_forms.form_times),
    "planning": Measure(planning.planning),
    "solver_times": Measure(solvers.solver_times),
    "page_speed": Measure(pages.page_speed),
    "identification_times": Measure(identification.identification_times),
}
# a process that uses a lesser processor; its arguments: two folders, then names of measures
CHILD = """
import sys
from pathlib import Path
import serpentail as st
from benchmarks.measures import measure
with st.progress():
    measure(sys.argv[3:], *map(Path, sys.argv[1:3]))
"""


def bench(output: Path, names: Sequence[str] = tuple(MEASURES)) -> None:
    """Run the named measures, write the report, and print it.

    What is measured is kept in OUTPUT/measured until the report is written, so that an interrupted
    run resumes if neither the sources nor the machine have changed.
    """
    there = processors.processors()
    kept = output / "measured" / state()
    report: dict = {"machine": machine(there), "seconds": []}
    for processor in there:
        wanted = [name for name in names if MEASURES[name].each or processor is there[0]]
        for name, found in on(processor, wanted, kept / processor.name).items():
            tag = {"processor": processor.name} if MEASURES[name].each else {}
            report.setdefault(name, []).extend(tag | row for row in found["rows"])
            report["seconds"].append({"measure": name} | tag | {"took_s": found["seconds"]})
    report = {name: report[name] for name in ("machine", *MEASURES, "seconds") if name in report}
    pictures = drawn(report, output)
    words = {name: MEASURES[name].rows.__doc__ for name in MEASURES if name in report}
    print(written(output, report, words, pictures))
    print(f"written: {output}: report.md, report.html, report.json, figures.json", file=sys.stderr)
    shutil.rmtree(kept.parent)


def state() -> str:
    """Return a hash of what a measure depends on: sources and processor."""
    sources = digest(*(ROOT / name for name in SOURCES))
    told = f"{sources} {processors.processor_line('model name')} {os.cpu_count()}"
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def on(processor: processors.Processor, names: list[str], kept: Path) -> dict[str, dict]:
    """Return what measures found on a processor, which a process of its own uses if it is a lesser
    one.
    """
    kept.mkdir(parents=True, exist_ok=True)
    missing = [name for name in names if not of(kept, name).exists()]
    with tempfile.TemporaryDirectory() as scratch:
        if missing and processor.level is None:
            measure(missing, Path(scratch), kept)
        elif missing:
            command = [sys.executable, "-c", CHILD, scratch, str(kept), *missing]
            subprocess.run(command, cwd=ROOT, env=processor.environment, check=True)
    return {name: json.loads(of(kept, name).read_text()) for name in names}


def measure(names: Sequence[str], scratch: Path, kept: Path) -> None:
    """Run measures, and keep the rows of each and the seconds that it took."""
    with Stage("bench", processors.march()) as stage:
        for done, name in enumerate(names):
            stage.tell(done / len(names), name.replace("_", " "))
            begun = time.perf_counter()
            rows = MEASURES[name].rows(scratch)
            found = {"rows": rows, "seconds": time.perf_counter() - begun}
            with replacing(of(kept, name)) as part:
                part.write_text(json.dumps(found, default=float))


def of(kept: Path, name: str) -> Path:
    """Return the file that keeps what a measure found."""
    return kept / f"{name}.json"


def drawn(report: dict, output: Path) -> list[Path]:
    """Draw the pictures of what was measured."""
    draw = {
        "continuum_form_times": lambda path: continuum_forms.draw(
            report["continuum_forms"], report["continuum_form_times"], path
        ),
        "scaling": lambda path: scaling.draw(report["scaling"], path),
        "simulation_times": lambda path: simulations.draw(report["simulation_times"], path),
    }
    names = {"continuum_form_times": "continuum_forms", "simulation_times": "simulations"}
    pictures = []
    for measure in (name for name in draw if name in report):
        pictures.append(output / f"{names.get(measure, measure)}.png")
        draw[measure](pictures[-1])
    return pictures


def machine(there: list[processors.Processor]) -> dict:
    """Return the processor, what stands for which, and the compilers."""
    from serpentail.compiling.compiler import describe_compiler

    columns = [f"{p.name} as {p.level}" if p.level else p.name for p in there]
    return {
        "processor": processors.processor_line("model name") or there[0].name,
        "cores": os.cpu_count(),
        "columns": ", ".join([*columns, *processors.left_out(there)]),
        "compiler": describe_compiler()["version"].splitlines()[0],
        "peers": compilers.told(compilers.compilers()),
    }

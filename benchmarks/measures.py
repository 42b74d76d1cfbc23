"""What `make bench` measures, in this order, and the report of one run of it."""

import os
import platform
import sys
import tempfile
from pathlib import Path

from benchmarks import (
    batches,
    contact_costs,
    contact_shares,
    continuum_forms,
    derivatives,
    pages,
    planning,
    precisions,
    scaling,
    simulations,
    speeds,
)
from benchmarks.peers import mujoco_casadi as more_peers
from benchmarks.peers import soromox as continuum_peer
from benchmarks.report import written
from serpentail.stages import Stage

MEASURES = {
    "generation": speeds.generation,
    "speed": speeds.speed,
    "other_peers": more_peers.other_peers,
    "scaling": scaling.scaling,
    "batch_times": batches.batch_times,
    "rollout_rates": batches.rollout_rates,
    "precision_times": precisions.precision_times,
    "tails": speeds.tails,
    "continuum_peer": continuum_peer.continuum_peer,
    "jacobian_times": derivatives.jacobian_times,
    "hessian_times": derivatives.hessian_times,
    "derivative_code": derivatives.derivative_code,
    "python_overhead": speeds.python_overhead,
    "drift": speeds.drift,
    "work_precision": speeds.work_precision,
    "simulation_summary": simulations.simulation_summary,
    "simulation_times": simulations.simulation_times,
    "mujoco_times": simulations.mujoco_times,
    "contact_costs": contact_costs.contact_costs,
    "contact_shares": contact_shares.contact_shares,
    "continuum_forms": continuum_forms.form_errors,
    "continuum_form_times": continuum_forms.form_times,
    "planning": planning.planning,
    "page_speed": pages.page_speed,
}


def bench(output: Path) -> None:
    """Measure everything, write the report, print it."""
    report = {"machine": machine()}
    with tempfile.TemporaryDirectory() as folder, Stage("bench") as stage:
        for done, (name, measure) in enumerate(MEASURES.items()):
            stage.tell(done / len(MEASURES), name.replace("_", " "))
            report[name] = measure(Path(folder))
    output.mkdir(parents=True, exist_ok=True)
    pictures = [output / f"{name}.png" for name in ("continuum_forms", "scaling", "simulations")]
    continuum_forms.draw(report["continuum_forms"], report["continuum_form_times"], pictures[0])
    scaling.draw(report["scaling"], pictures[1])
    simulations.draw(report["simulation_times"], pictures[2])
    print(written(output, report, MEASURES, pictures))
    print(f"written: {output}: report.md, report.html, report.json and pictures", file=sys.stderr)


def machine() -> dict:
    """Return the processor and compiler."""
    from serpentail.model.compiler import describe_compiler

    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    processor = next(
        (line.split(":")[1].strip() for line in lines if line.startswith("model name")),
        platform.machine(),
    )
    return {
        "processor": processor,
        "cores": os.cpu_count(),
        "compiler": describe_compiler()["version"].splitlines()[0],
    }

"""All derivative functions as loops: operations of a call, bytes of C, processor seconds.

Generation is measured as one process from its start; compilation is the whole time of the compiler,
with the flags of users.
"""

import resource
from pathlib import Path

import serpentail as st
from benchmarks.models import DFD, HESSIAN, label
from serpentail.building.generator import generate
from serpentail.compiling.compiler import compile_library
from serpentail_scene.signatures.table import DERIVATIVES

SIZES = ((1, 3), (3, 4), (6, 6), (8, 16))


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    return [row(folder, size) for size in SIZES]


def row(folder: Path, size: tuple[int, int]) -> dict:
    """Return the figures of one tail."""
    scene = folder / f"derivatives_m{size[0]}_n{size[1]}.toml"
    lines = ['kind = "articulated"', f"segments = {size[0]}", f"links = {size[1]}"]
    lines += [f"functions = {list(DERIVATIVES)}", 'emission = "loops"', ""]
    scene.write_text("\n".join(lines))
    begun = children_seconds()
    made = generate(scene, folder / f"made_{scene.stem}")
    derived = children_seconds()
    sources = [made / "src" / f"{made.name}{ending}.c" for ending in ("", "_host")]
    compile_library(sources, made / "include", cache=folder / f"empty_{made.name}")
    compiled = children_seconds()
    counts = st.load(made, compiled=False).manifest["functions"]
    found: dict = {"model": label(*size)}
    for name in (DFD, "inverse_dynamics_derivatives", HESSIAN):
        found[f"operations of {name}"] = counts[name]["operations"]
    found |= {"C, bytes": sources[0].stat().st_size}
    return found | {"generate, CPU s": derived - begun, "compile, CPU s": compiled - derived}


def children_seconds() -> float:
    """Return processor seconds of all processes started here that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime

"""What contact costs: operation counts, bytes of C and nanoseconds of a flight, a stance and a tail
contact.

Times are processor time of single calls from C, the least of many rounds over the same states,
functions in turn.
"""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("contact_costs", __doc__)

import json
import subprocess
from pathlib import Path

import numpy as np

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for

SCENES = {"flight": (), "stance": ("feet",), "tail": ("feet", "tail")}
SIZES = ((1, 3), (3, 4), (3, None))
FLIGHT = ("forward_dynamics", "pfl", "implicit")
TOUCHING = ("contact_points", "contact_dynamics")
FLAGS = [
    "-std=c99",
    "-O2",
    "-ffp-contract=fast",
    "-fno-tree-vectorize",
    "-fno-math-errno",
    "-fno-trapping-math",
]
FLAGS += ["-march=native"]
STATES, ROUNDS = 64, 300
STANDING = [0, 0, 0.0225, 1, 0.1, 0, 0]  # as a rat stands: half of its foot points in the ground
LEGS = [3.665, -0.2618, 3.665, -0.2618, 0, 0, 0, 0]
DRIVER = """#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "{name}.h"
static double read_reals(FILE *file, double *to, long count)
{{
  return fread(to, sizeof *to, (size_t)count, file) == (size_t)count ? 0.0 : 1.0;
}}
int main(int argc, char **argv)
{{
  {name}_parameters parameters;
  {name}_default_parameters(&parameters);
  double best[{functions}], *work = calloc({work}, sizeof *work);
  FILE *file = fopen(argv[argc - 1], "rb");
{declarations}
  for (int f = 0; f < {functions}; ++f) best[f] = 1e9;
  for (int round = 0; round < {rounds}; ++round) {{
    clock_t start;
{calls}
  }}
  for (int f = 0; f < {functions}; ++f) printf("%g\\n", best[f]);
  return 0;
}}
"""


def made(parent: Path, size: tuple, contacts: tuple[str, ...]) -> Path:
    """Generate one scene of a tail."""
    segments, links = size
    functions = [*FLIGHT, *(TOUCHING if contacts else ())]
    options = {"contacts": list(contacts)} if contacts else {}
    scene = scene_for(
        "articulated" if links else "continuum", segments, links, functions=functions, **options
    )
    generate(scene, parent / "_".join(("scene", *contacts)))
    return parent / "_".join(("scene", *contacts)) / scene.name


def inputs(manifest: dict) -> dict[str, np.ndarray]:
    """States near standing with small rates, and right-hand sides, by argument."""
    rng, sizes = np.random.default_rng(1), manifest["dimensions"]
    points = sum(entry["count"] for entry in manifest["contacts"])
    shapes = {
        "v": sizes["nv"],
        "tau": sizes["nt"],
        "accelerations": sizes["nt"],
        "bristles": 2 * points,
    }
    shapes |= {"r_q": sizes["nv"], "r_v": sizes["nv"], "r_u": 2 * points}
    given = {name: rng.normal(0, 1e-3, (STATES, size)) for name, size in shapes.items()}
    tail = rng.normal(0, 0.2, (STATES, sizes["nt"]))
    given |= {
        "q": np.hstack([np.tile(STANDING, (STATES, 1)), tail]),
        "legs": np.tile(LEGS, (STATES, 1)),
    }
    given |= {"damping": np.full((STATES, sizes["nt"]), 1e-3), "gains": np.zeros((STATES, 2))}
    return given | {"weight": np.tile([1e-4, 1.0] if points else [1e-4], (STATES, 1))}


def driver(manifest: dict, given: dict[str, np.ndarray]) -> tuple[str, list[np.ndarray]]:
    """C that times every function, and the arrays that it reads in order."""
    lines, calls, data = [], [], []
    for number, (name, entry) in enumerate(manifest["functions"].items()):
        arguments = []
        for a in (*entry["inputs"], *entry["outputs"]):
            length = int(np.prod(a["shape"]))
            variable = a["name"] if a["name"] == "factors" else f"{name}_{a['name']}"
            if a["name"] == "factors" and a in entry["inputs"]:  # as factored before, of each state
                arguments.append(f"factors + k * {length}")
                continue
            lines.append(f"  double *{variable} = calloc({STATES * length}, sizeof(double));")
            arguments.append(f"{variable} + k * {length}")
            if a in entry["inputs"]:
                lines.append(
                    f"  if (read_reals(file, {variable}, {STATES * length}) > 0.0) return 2;"
                )
                data.append(given[a["name"]])
        call = f"{manifest['prefix']}_{name}(&parameters, {', '.join(arguments)}, work)"
        calls += [
            "    start = clock();",
            f"    for (int repeat = 0; repeat < 8; ++repeat) for (long k = 0; k < {STATES}; ++k) "
            f"if ({call}) return 1;",
            f"    const double t{number} = (double)(clock() - start) / CLOCKS_PER_SEC / "
            f"{8 * STATES};",
            f"    if (t{number} < best[{number}]) best[{number}] = t{number};",
        ]
    text = DRIVER.format(
        name=manifest["prefix"],
        functions=len(manifest["functions"]),
        work=max(manifest["work"].values()) + 1,
        declarations="\n".join(lines),
        rounds=ROUNDS,
        calls="\n".join(calls),
    )
    return text, data


def timed(folder: Path) -> dict[str, float]:
    """Nanoseconds of one call of each function."""
    manifest = json.loads((folder / "manifest.json").read_text())
    text, data = driver(manifest, inputs(manifest))
    (folder / "driver.c").write_text(text)
    np.concatenate([array.ravel() for array in data]).tofile(folder / "states.bin")
    sources = [folder / "driver.c", folder / "src" / f"{manifest['prefix']}.c"]
    subprocess.run(
        ["cc", *FLAGS, "-I", folder / "include", *sources, "-o", folder / "driver", "-lm"],
        check=True,
    )
    printed = subprocess.run(
        [folder / "driver", folder / "states.bin"], check=True, capture_output=True, text=True
    )
    return dict(
        zip(manifest["functions"], (1e9 * float(t) for t in printed.stdout.split()), strict=True)
    )


def contact_costs(folder: Path) -> list[dict]:
    """Cost of a flight, a stance (feet) and a tail contact (feet, tail) of one model: size of its C
    file, operations and calls. Operations of one evaluation; processor time of single calls from C,
    with half of the foot points in the ground.
    """
    rows = []
    for size in SIZES:
        for scene, contacts in SCENES.items():
            made_at = made(folder / "costs", size, contacts)
            manifest = json.loads((made_at / "manifest.json").read_text())
            dynamics, ns = "contact_dynamics" if contacts else "forward_dynamics", timed(made_at)
            operations = {
                name: entry["operations"] for name, entry in manifest["functions"].items()
            }
            row = {
                "model": made_at.name,
                "scene": scene,
                "points": sum(e["count"] for e in manifest["contacts"]),
            }
            row |= {"c_bytes": (made_at / "src" / f"{manifest['prefix']}.c").stat().st_size}
            row |= {"dynamics_operations": operations[dynamics], "dynamics_ns": ns[dynamics]}
            row |= {
                "implicit_operations": operations["implicit_factor"],
                "implicit_ns": ns["implicit_factor"],
            }
            rows.append(row)
    return rows

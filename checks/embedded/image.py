"""Builds the program that checks a model on a board."""

import json
import math
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from checks.embedded.boards import HERE, PROFILES, WARNINGS, Board
from checks.embedded.states import stored_states

LONGEST_REPORT = 3000  # characters of what a compiler says
# for the harness only, which uses attributes and assembly
C_LINES = ("-std=gnu11", "-I", str(HERE))
# the start of cases.h in all checks
CASE = """struct a_case {{
  const char *name;
  int (*call)(const real *state, real *outputs, real *work);
  int outputs;
}};

"""
BARE = """static int call_nothing(const real *state, real *outputs, real *work)
{{
  (void)state;
  (void)outputs;
  (void)work;
  return 0;
}}

/* Uses a known amount of stack, for comparison. */
static int call_room(const real *state, real *outputs, real *work)
{{
  volatile uint32_t room[32];
  for (int k = 0; k < 32; ++k) {{
    room[k] = 0;
  }}
  return call_nothing(state, outputs, work);
}}
"""
HEAD = (
    """/* Stored states of {prefix}, and its functions with one common signature. */
#ifndef CASES_H
#define CASES_H

#include <stdint.h>

#include "{prefix}.h"

typedef {prefix}_real real;
#define REAL_IS_FLOAT {single}
enum {{ STATES = {states}, INPUTS = {inputs}, OUTPUTS = {outputs} }};
enum {{ WORK = {work}, CASES = {cases} }};

"""
    + CASE
    + """static {prefix}_parameters parameters;

static void prepare(void)
{{
  {prefix}_default_parameters(&parameters);
}}

"""
    + BARE
)
CALL = """
static int call_{name}(const real *state, real *outputs, real *work)
{{
  (void)work;
  return {prefix}_{name}(&parameters, {arguments}, work);
}}
"""


@dataclass(frozen=True)
class Image:
    """A program for a board, the folder it was made in, and the model's manifest and states."""

    board: Board
    path: Path
    manifest: dict
    states: dict[str, np.ndarray]


def build(folder: Path, board: Board, output: Path, profile: str | None = None) -> Image:
    """Write cases.h and build the check for a board; raises ToolchainMissing, or RuntimeError with
    what gcc said.
    """
    board.need()
    manifest = manifest_of(folder)
    profile = profile or manifest["scene"]["profile"]
    states = stored_states(manifest)
    output.mkdir(parents=True, exist_ok=True)
    (output / "cases.h").write_text(cases(manifest, states))
    flags = (
        *board.cpu,
        *PROFILES[profile],
        "-ffunction-sections",
        "-fdata-sections",
        "-fcallgraph-info=su",
    )
    model = compiled(
        board,
        folder / "src" / f"{manifest['prefix']}.c",
        output,
        ("-std=c99", *WARNINGS, *flags),
        folder,
    )
    harness = [
        compiled(board, HERE / name, output, (*C_LINES, *flags), folder)
        for name in ("check.c", board.port)
    ]
    image = output / "image.elf"
    command(
        [
            board.compiler,
            *board.cpu,
            *board.link,
            *map(str, (model, *harness)),
            "-lm",
            "-o",
            str(image),
        ]
    )
    return Image(board, image, manifest, states)


def manifest_of(folder: Path) -> dict:
    """Return the manifest of a generated folder."""
    return json.loads((folder / "manifest.json").read_text())


def compiled(
    board: Board, source: Path, output: Path, flags: tuple[str, ...], folder: Path
) -> Path:
    """Compile one source; return its object file."""
    target = output / f"{source.stem}.o"
    include = ("-I", str(folder / "include"), "-I", str(output))
    command([board.compiler, *flags, *include, "-c", str(source), "-o", str(target)])
    return target


def command(words: list[str]) -> str:
    """Run a command beside the linker scripts; return what it printed, raise RuntimeError where it
    fails.
    """
    done = subprocess.run(words, cwd=HERE, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(
            f"{' '.join(words)} failed with "
            f"{done.returncode}:\n{(done.stdout + done.stderr)[:LONGEST_REPORT]}"
        )
    return done.stdout


def cases(manifest: dict, states: dict[str, np.ndarray]) -> str:
    """Return the text of cases.h."""
    first, inputs = {}, 0
    for name, rows in states.items():
        first[name], inputs = inputs, inputs + rows.shape[1]
    lengths = {name: sum(sizes(entry["outputs"])) for name, entry in manifest["functions"].items()}
    text = HEAD.format(
        prefix=manifest["prefix"],
        single=int(manifest["real"] == "float"),
        states=len(next(iter(states.values()))),
        inputs=inputs,
        outputs=max(lengths.values()),
        work=max(manifest["work"].values()) + 1,
        cases=2 + len(lengths),
    )
    for name, entry in manifest["functions"].items():
        text += CALL.format(
            name=name, prefix=manifest["prefix"], arguments=", ".join(arguments(entry, first))
        )
    text += "\nstatic const struct a_case cases[CASES] = {\n"
    text += "".join(
        f'  {{"{name}", call_{name}, {n}}},\n'
        for name, n in {"nothing": 0, "room": 0, **lengths}.items()
    )
    text += "};\n\nstatic const real states[STATES][INPUTS] = {\n"
    suffix = "f" if manifest["real"] == "float" else ""
    for row in np.hstack(list(states.values())):
        text += f"  {{{', '.join(float(x).hex() + suffix for x in row)}}},\n"
    return text + "};\n\n#endif\n"


def arguments(entry: dict, first: dict[str, int]) -> list[str]:
    """Return the C expressions of a function's inputs and outputs."""
    inputs = [f"state + {first[a['name']]}" for a in entry["inputs"]]
    ends = np.cumsum([0, *sizes(entry["outputs"])])
    return inputs + [f"outputs + {end}" for end in ends[:-1]]


def sizes(entries: list[dict]) -> list[int]:
    """Return the lengths of arrays."""
    return [math.prod(a["shape"]) for a in entries]

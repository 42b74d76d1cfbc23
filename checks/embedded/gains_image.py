"""Builds and runs the program that checks a plan's gains on a board, in float."""

from pathlib import Path

import numpy as np

import serpentail as st
from checks.embedded.boards import BOARDS, HERE, PROFILES, WARNINGS, Board
from checks.embedded.image import BARE, C_LINES, CASE, Image, command, compiled
from checks.embedded.results import Result, run

TIMES = np.linspace(0.0, 0.999, 12)  # of the plan's duration
HEAD = (
    """/* States at which ticks are computed: t, q, v. */
#include <stdint.h>

#include "{prefix}_gains.h"

typedef float real;
#define REAL_IS_FLOAT 1
enum {{ STATES = {states}, NQ = {nq}, INPUTS = {inputs}, OUTPUTS = {nt}, WORK = 1, CASES = 3 }};

"""
    + CASE
    + """static float memory[{upper}_GAINS_MEMORY];
static {prefix}_gains_state controller;

static void prepare(void)
{{
  {prefix}_gains_begin(&controller, &{prefix}_gains_plan, memory);
}}

"""
    + BARE
    + """
static int call_tick(const real *state, real *outputs, real *work)
{{
  (void)work;
  return {prefix}_gains_tick(&controller, state[0], state + 1, state + 1 + NQ, outputs);
}}

static const struct a_case cases[CASES] = {{
  {{"nothing", call_nothing, 0}},
  {{"room", call_room, 0}},
  {{"tick", call_tick, OUTPUTS}},
}};

static const real states[STATES][INPUTS] = {{
"""
)


def states_of(gains: st.Gains) -> np.ndarray:
    """Return rows (t, q, v) of float: states of the plan, with 0.1 rad/s more about an axis."""
    times = TIMES * gains.plan.duration
    motion = gains.plan.trajectory.resample(times)
    off = 0.1 * (np.arange(motion.v.shape[1]) == 3)
    return np.column_stack([times, motion.q, motion.v + off]).astype(np.float32)


def ticks(gains: st.Gains, board: str, output: Path, profile: str) -> Result:
    """Return the torques of ticks on a board, their statuses and costs."""
    return run(_built(gains, BOARDS[board], output, profile))["tick"]


def _built(gains: st.Gains, board: Board, output: Path, profile: str) -> Image:
    """Write cases.h and the gains, and build the check for a board."""
    board.need()
    states, prefix, model = states_of(gains), gains.model.name, gains.model
    _, source = gains.write_c(output, "float")
    sizes = {"states": len(states), "inputs": states.shape[1], "nq": model.nq}
    text = HEAD.format(prefix=prefix, upper=prefix.upper(), nt=model.layout.nt, **sizes)
    rows = ("".join(f"{float(x).hex()}f, " for x in state) for state in states)
    (output / "cases.h").write_text(text + "".join(f"  {{{row}}},\n" for row in rows) + "};\n")
    flags = (*board.cpu, *PROFILES[profile])
    objects = [compiled(board, source, output, ("-std=c99", *WARNINGS, *flags), output)]
    for name in ("check.c", board.port):
        objects.append(compiled(board, HERE / name, output, (*C_LINES, *flags), output))
    image = output / "image.elf"
    words = [board.compiler, *board.cpu, *board.link, *map(str, objects), "-lm", "-o", str(image)]
    command(words)
    return Image(board, image, {"real": "float"}, {"states": states})

"""Builds and runs the program that checks a predictive controller on a board."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from checks.embedded.boards import BOARDS, HERE, PROFILES, WARNINGS, Board
from checks.embedded.image import BARE, C_LINES, CASE, Image, command, compiled, manifest_of
from checks.embedded.results import Result, run

TIMES = (0.0, 0.1, 0.2)  # s, times of the ticks
TRIALS = 3  # MPC_TRIALS
SHOWN = 4  # number of times at which the torques of a tick are read
HEAD = (
    """/* States at which ticks are computed: t, then q, v, then q, v of the next tick. */
#ifndef CASES_H
#define CASES_H

#include <stdint.h>

#include "{prefix}.h"
#include "{prefix}_mpc.c" /* with its inner functions */

typedef {real} real;
#define REAL_IS_FLOAT {single}
enum {{ STATES = {states}, NQ = {nq}, NV = {nv}, NT = NV - 6, INPUTS = 1 + 2 * (NQ + NV) }};
enum {{ SHOWN = {shown}, OUTPUTS = SHOWN * NT, WORK = 1, CASES = 9 }};

"""
    + CASE
    + """static real memory[{upper}_MPC_MEMORY];
static {prefix}_mpc_state controller;

static void prepare(void)
{{
}}

"""
    + BARE
    + """
/* Torques from t to the end of the plan. */
static int torques(real t, real *outputs)
{{
  for (int k = 0; k < SHOWN; ++k) {{
    const real at = t + (real)k * ({prefix}_mpc_plan.end - t) / (real)SHOWN;
    {prefix}_mpc_torque(&controller, at, at, outputs + k * NT);
  }}
  return (int)controller.failed;
}}

static int call_tick(const real *state, real *outputs, real *work)
{{
  (void)work;
  {prefix}_mpc_begin(&controller, &{prefix}_mpc_plan, memory);
  {prefix}_mpc_tick(&controller, state[0], state + 1, state + 1 + NQ);
  return torques(state[0], outputs);
}}

static int call_two_ticks(const real *state, real *outputs, real *work)
{{
  const real later = state[0] + {prefix}_mpc_plan.period, *next = state + 1 + NQ + NV;
  real tau[NT];
  (void)work;
  {prefix}_mpc_begin(&controller, &{prefix}_mpc_plan, memory);
  {prefix}_mpc_control(&controller, state[0], state[0], state + 1, state + 1 + NQ, tau);
  {prefix}_mpc_control(&controller, later, later, next, next + NQ, tau);
  return torques(later, outputs);
}}

/* The parts of a tick: what comes first; a motion; one with slopes; a quadratic program. */
static {prefix}_mpc_workspace tick;

static int call_first(const real *state, real *outputs, real *work)
{{
  (void)outputs;
  (void)work;
  {prefix}_mpc_begin(&controller, &{prefix}_mpc_plan, memory);
  lay_out(&{prefix}_mpc_plan, memory, &tick);
  if (prepared(&controller, &tick, state[0], state + 1, state + 1 + NQ) != 0) {{
    return 1;
  }}
  tick.motion.correction = tick.fresh;
  return 0;
}}

static int call_motion(const real *state, real *outputs, real *work)
{{
  {prefix}_mpc_program plain = {{0, 0, NULL, NULL}};
  return call_first(state, outputs, work) + {prefix}_mpc_program_of(&tick.motion, tick.x0, &plain);
}}

static int call_derivatives(const real *state, real *outputs, real *work)
{{
  return call_first(state, outputs, work)
         + {prefix}_mpc_program_of(&tick.motion, tick.x0, &tick.program);
}}

/* Return the changes of a quadratic program whose torques have some room (N m). */
static int solve(const real *state, real room, real *outputs, real *work)
{{
  if (call_derivatives(state, outputs, work) != 0) {{
    return 0;
  }}
  for (int i = 0; i < tick.qp.n; ++i) {{
    tick.lower[i] = tick.fresh[i] - room * (real)(1 + i % 3);
    tick.upper[i] = tick.fresh[i] + room * (real)(1 + i % 3);
  }}
  {prefix}_mpc_write_limits(&tick, tick.fresh);
  for (int i = tick.qp.n; i < tick.qp.n + tick.qp.rows; ++i) {{ /* only torques are bounded */
    tick.low[i] = -NONE;
    tick.high[i] = NONE;
  }}
  return {prefix}_mpc_quadratic(&tick.qp);
}}

static int call_free(const real *state, real *outputs, real *work)
{{
  return solve(state, 1000, outputs, work);
}}

/* most bounds are active */
static int call_bounded(const real *state, real *outputs, real *work)
{{
  return solve(state, (real)1 / 100000, outputs, work);
}}

static const struct a_case cases[CASES] = {{
  {{"nothing", call_nothing, 0}},
  {{"room", call_room, 0}},
  {{"tick", call_tick, OUTPUTS}},
  {{"two_ticks", call_two_ticks, OUTPUTS}},
  {{"first", call_first, 0}},
  {{"motion", call_motion, 0}},
  {{"slopes", call_derivatives, 0}},
  {{"free", call_free, 0}},
  {{"bounded", call_bounded, 0}},
}};

static const real states[STATES][INPUTS] = {{
"""
)


@dataclass(frozen=True)
class Ticks:
    """Ticks on a board: whether their bits are the host's; instructions of those that were made,
    and the most of any tick; bytes of stack, of code with constants, and of memory; torques as
    (states, times * 2m).
    """

    same_bits: bool
    failed: int
    instructions: int
    most: int
    stack: int
    code: int
    memory: int
    torques: np.ndarray


def states_of(mpc: st.Mpc) -> np.ndarray:
    """Return rows (t, q, v, q, v): states of a plan at a tick and one period later, each with
    0.1 rad/s more about the torso's x axis.
    """
    period, motion = 1 / mpc.settings.rate, mpc.plan.trajectory
    rows = []
    for t in TIMES:
        row = [np.array([t])]
        for at in (t, t + period):
            sample = motion.resample(np.array([at]))
            row += [sample.q[0], sample.v[0] + 0.1 * (np.arange(sample.v.shape[1]) == 3)]
        rows.append(np.concatenate(row))
    return np.array(rows)


def ticks(folder: Path, mpc: st.Mpc, board: str, output: Path, profile: str) -> Ticks:
    """Run a controller of a generated folder's model on a board and on the host."""
    images = [built(folder, mpc, BOARDS[name], output / name, profile) for name in (board, "host")]
    found, host = (run(image) for image in images)
    own = found["tick"], found["two_ticks"]
    same = all(
        (found[name].bits == host[name].bits).all() and found[name].statuses == host[name].statuses
        for name in ("tick", "two_ticks")
    )
    controller = images[0].path.parent / f"{mpc.model.name}_mpc.o"
    size = command(["arm-none-eabi-size", str(controller)]).splitlines()[1].split()
    return Ticks(
        same,
        max(max(result.statuses) for result in own),
        max(own[0].instructions),
        most_instructions(found, mpc),
        max(own[0].depths),
        int(size[0]) + int(size[1]),
        mpc.memory_size * (4 if manifest_of(folder)["real"] == "float" else 8),
        found["two_ticks"].values,
    )


def most_instructions(found: dict[str, Result], mpc: st.Mpc) -> int:
    """Return the most instructions of a tick: all its steps, each with all its trials and changes
    of the active set, from those of the parts.
    """
    parts = ("first", "motion", "slopes", "free")
    first, motion, slopes, free = (max(found[name].instructions) for name in parts)
    n = mpc.settings.intervals * mpc.model.layout.nt
    changes = zip(found["bounded"].instructions, found["bounded"].statuses, strict=True)
    change = max((bounded - free) / count for bounded, count in changes)
    program = free - slopes + (3 * n + 10) * change
    step = slopes - first + TRIALS * (motion - first) + program
    return int(first + mpc.settings.iterations * step)


def built(folder: Path, mpc: st.Mpc, board: Board, output: Path, profile: str) -> Image:
    """Write cases.h and the controller, and build the check for a board."""
    board.need()
    manifest, states, prefix = manifest_of(folder), states_of(mpc), mpc.model.name
    output.mkdir(parents=True, exist_ok=True)
    (output / "cases.h").write_text(cases(mpc, states))
    _, controller = mpc.write_c(output)
    flags = (*board.cpu, *PROFILES[profile], "-ffunction-sections", "-fdata-sections")
    strict = ("-std=c99", *WARNINGS, *flags)
    model = folder / "src" / f"{prefix}.c"
    objects = [compiled(board, path, output, strict, folder) for path in (model, controller)]
    objects.pop()  # the check includes the controller
    for name in ("check.c", board.port):
        objects.append(compiled(board, HERE / name, output, (*C_LINES, *flags), folder))
    image = output / "image.elf"
    words = [board.compiler, *board.cpu, *board.link, *map(str, objects), "-lm", "-o", str(image)]
    command(words)
    return Image(board, image, manifest, {"states": states})


def cases(mpc: st.Mpc, states: np.ndarray) -> str:
    """Return the text of cases.h."""
    prefix, model = mpc.model.name, mpc.model
    real = model.manifest["real"]
    text = HEAD.format(
        prefix=prefix,
        real=real,
        single=int(real == "float"),
        upper=prefix.upper(),
        states=len(states),
        nq=model.nq,
        nv=model.nv,
        shown=SHOWN,
    )
    for row in states:
        suffix = "f" if real == "float" else ""
        text += f"  {{{', '.join(float(x).hex() + suffix for x in row)}}},\n"
    return text + "};\n\n#endif\n"

"""Writes a controller as C of one model and one plan, for machines without Python."""

import os
import re
from pathlib import Path

from ..model.model import Model
from ..planning.c_text import array_text, literal, write_texts
from .kernel import FUNCTIONS, SIZES, SOURCES, task_fields, text_of
from .settings import NEEDED
from .task import MpcTask

ARRAYS = [
    *("parameters", "times", "plan", "most_torque", "most_tail", "torque_weight", "rate_weight"),
    *("goal", "end_state", "end_weight", "track_weight"),
]
INCLUDE = re.compile(r'^#include "[^"]*"\n', re.MULTILINE)
NAME = re.compile(r"\b(mpc_|MPC_)")
USE = """/* The predictive controller of {prefix}, for one plan.

   static {real} memory[{upper}_MPC_MEMORY];
   static {prefix}_mpc_state state;

   At the start of the flight call {prefix}_mpc_begin(&state, &{prefix}_mpc_plan, memory).  Then, at
   the time t (s) from there, call {prefix}_mpc_control(&state, t, t, q, v, tau) as often as the
   motors take torques, which may be more often than the ticks.  tau does not contain joint damping,
   which belongs to the body.

   Link this file's source with src/{prefix}.c of the model.  The parameters of the body are the
   table {prefix}_mpc_plan.parameters: for another body, copy {prefix}_mpc_plan, and let the copy
   point to a {prefix}_parameters of yours. */

"""
DATA = """
/* the model's functions, with the arguments that the controller passes */
static int call_rates(const void *parameters, const double *x, const double *tau, const double *h,
                      double *y, double *work)
{{
    return {prefix}_{rates}((const {prefix}_parameters *)parameters, x, tau, h, y, work);
}}

static int call_slopes(const void *parameters, const double *x, const double *tau,
                       const double *h, double *y, double *J, double *work)
{{
    return {prefix}_{slopes}((const {prefix}_parameters *)parameters, x, tau, h, y, J, work);
}}

static int call_momentum(const void *parameters, const double *q, const double *v, double *linear,
                         double *angular, double *work)
{{
    return {prefix}_{momentum}((const {prefix}_parameters *)parameters, q, v, linear, angular,
                               work);
}}
"""


def write_c(model: Model, task: MpcTask, memory: int, folder: str | os.PathLike[str]) -> list[Path]:
    """Write <model>_mpc.h and .c to a folder; return their paths; memory: in numbers.

    Raises as ``write_texts``.
    """
    texts = {
        f"{model.name}_mpc.h": header(model.name, task.real, memory),
        f"{model.name}_mpc.c": source(model.name, task),
    }
    return write_texts(folder, texts)


def header(prefix: str, real: str, memory: int) -> str:
    """Return the header of a model's controller."""
    own = _renamed(text_of("mpc.h", real), prefix)
    begin, end = own.rsplit("#ifdef __cplusplus", 1)
    plan = (
        f"/* {real}s that the plan below needs */\n"
        f"enum {{ {prefix.upper()}_MPC_MEMORY = {memory} }};\n\n"
        f"extern const {prefix}_mpc_task {prefix}_mpc_plan;\n\n#ifdef __cplusplus{end}"
    )
    return USE.format(prefix=prefix, upper=prefix.upper(), real=real) + begin + plan


def source(prefix: str, task: MpcTask) -> str:
    """Return its source: the controller, then the plan."""
    names = ("mpc_layout.h", *SOURCES)
    parts = [INCLUDE.sub("", text_of(name, task.real)) for name in names]
    includes = f'#include "{prefix}.h"\n#include "{prefix}_mpc.h"\n\n'
    code = _renamed("\n".join(parts), prefix)
    calls = DATA.format(prefix=prefix, **NEEDED).replace("double", task.real)
    arrays = "\n".join(array_text(name, task.arrays[name], task.real, task.real) for name in ARRAYS)
    return includes + code + calls + "\n" + arrays + _plan(prefix, task)


def _renamed(text: str, prefix: str) -> str:
    """Return C whose names begin with the model's."""
    marks = {"mpc_": f"{prefix}_mpc_", "MPC_": f"{prefix.upper()}_MPC_"}
    return NAME.sub(lambda found: marks[found[0]], text)


def _plan(prefix: str, task: MpcTask) -> str:
    """Return the task, member by member."""
    values = {name: f"call_{name}" for name in FUNCTIONS} | {name: name for name in ARRAYS}
    for name, number in task.numbers.items():
        values[name] = str(int(number)) if name in SIZES else literal(number, task.real)
    rows = ",\n".join(f"    {values[name]} /* {name} */" for name, _ in task_fields(None))
    return f"\nconst {prefix}_mpc_task {prefix}_mpc_plan = {{\n{rows}\n}};\n"

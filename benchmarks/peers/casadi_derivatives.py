"""CasADi's own C of Jacobians and Hessians, as closures to time."""

import ctypes
import subprocess
import time
from pathlib import Path
from types import ModuleType

import casadi as ca
import numpy as np

import serpentail as st

from . import timing

CASADI_FLAGS = ("-O2", "-march=native", "-fPIC", "-shared")
PATIENCE = 240  # seconds for gcc on one of CasADi's files
OVER = f"over {PATIENCE} s"
IN_SX = ("mass_matrix", "bias_force", "inverse_dynamics")  # what CasADi differentiates
CASADI_CALL = """
struct context {{
  double parameters[{parameters}], out[{out}], work[{work} + 1];
  long long integers[{integers} + 1];
}};
int measured(void *c, const double *q, const double *v, const double *rest, double *seen);
int measured(void *c, const double *q, const double *v, const double *rest, double *seen)
{{
  struct context *context = c;
  const double *arguments[{arguments}] = {{q, v, rest, context->parameters}};
  double *results[{results}] = {{context->out, context->out + {first}}};
  int status = differentiated(arguments, results, context->integers, context->work, 0);
  seen[0] = context->out[0];
  return status;
}}
"""


class InCasadi:
    """A CasADi function of (q, v, rest, parameters) as C that gcc has compiled, for the timer."""

    def __init__(self, name: str, function: ca.Function, model: st.Model, folder: Path):
        """Generate and compile; subprocess.TimeoutExpired where gcc takes longer than PATIENCE."""
        source = folder / f"{model.name}_{name}.c"
        first, second = function.numel_out(0), function.numel_out(1)
        function.generate(source.name, {"with_header": False})
        sizes = {"parameters": len(model.parameter_vector), "out": first + second, "first": first}
        sizes |= {"work": function.sz_w(), "integers": function.sz_iw()}
        sizes |= {"arguments": max(4, function.sz_arg()), "results": max(2, function.sz_res())}
        source.write_text(Path(source.name).read_text() + CASADI_CALL.format(**sizes))
        Path(source.name).unlink()
        begun = time.perf_counter()
        command = ["gcc", *CASADI_FLAGS, str(source), "-o", str(source.with_suffix(".so")), "-lm"]
        subprocess.run(command, check=True, timeout=PATIENCE)
        self.seconds = time.perf_counter() - begun
        self.function = ctypes.CDLL(str(source.with_suffix(".so"))).measured
        self.context = np.zeros(
            sum(sizes[name] for name in ("parameters", "out", "work", "integers")) + 2
        )
        self.context[: sizes["parameters"]] = model.parameter_vector
        self.out = self.context[sizes["parameters"] :][: first + second]
        self.shapes = [function.size_out(k) for k in range(2)]

    @property
    def closure(self) -> timing.Closure:
        """What the timer calls."""
        return timing.Closure(
            ctypes.cast(self.function, ctypes.c_void_p).value, self.context.ctypes.data
        )

    def __call__(self, *arrays) -> list[np.ndarray]:
        """Both matrices."""
        arrays = [np.ascontiguousarray(array) for array in (*arrays, np.zeros(1))]
        addresses = [ctypes.c_void_p(array.ctypes.data) for array in (self.context, *arrays)]
        if self.function(*addresses):
            raise FloatingPointError("CasADi's C reports a failure")
        first = int(np.prod(self.shapes[0]))
        parts = (self.out[:first], self.out[first:])
        return [
            part.reshape(shape, order="F").copy()
            for part, shape in zip(parts, self.shapes, strict=True)
        ]


class Graph:
    """Symbols of a state of one model, and its equations of motion as SX expressions of them."""

    def __init__(self, model: st.Model):
        self.module, self.nv, self.nt = casadi_module(model), model.nv, model.nv - 6
        self.q, self.v = ca.SX.sym("q", model.nq), ca.SX.sym("v", model.nv)
        self.turn = ca.SX.sym("turn", 3)
        self.parameters = ca.SX.sym("parameters", len(model.parameter_vector))
        self.fields, first = {}, 0
        for name, size in self.module.PARAMETERS.items():
            self.fields[name] = ca.vertsplit(self.parameters[first : first + size])
            first += size

    def turned(self) -> list:
        """The numbers of q, the torso turned by ``turn``; to second order the exponential map, as q
        is normalised.
        """
        w, x, y, z = ca.vertsplit(self.q[3:7])
        a, b, c = ca.vertsplit(self.turn / 2)
        turned = [w - x * a - y * b - z * c, x + w * a + y * c - z * b]
        turned += [y + w * b + z * a - x * c, z + w * c + x * b - y * a]
        return ca.vertsplit(self.q[:3]) + turned + ca.vertsplit(self.q[7:])

    def force(self, q, v_dot):
        """H v_dot + C."""
        result = self.module.inverse_dynamics(
            self.fields, q=q, v=ca.vertsplit(self.v), v_dot=ca.vertsplit(v_dot)
        )
        return ca.vertcat(*result["force"])

    def finished(self, rest, results) -> ca.Function:
        """Return the function of (q, v, rest, parameters), without a turn, equal subexpressions
        computed once.
        """
        results = ca.cse(ca.substitute(results, [self.turn], [ca.SX.zeros(3)]))
        return ca.Function(
            "differentiated",
            [self.q, self.v, rest, self.parameters],
            [ca.densify(r) for r in results],
        )


def casadi_module(model: st.Model) -> ModuleType:
    """Return the generated module that builds SX expressions."""
    return model.checked.casadi_module


def jacobians(model: st.Model, turn_by_hand: bool) -> ca.Function:
    """-H^-1 dID in SX: columns of tail coordinates, omega and rates, torques; then those of a turn
    of the torso.

    A turn of the torso moves p_b_ddot + g z along and leaves all else; by hand, it is written so.
    """
    g = Graph(model)
    tau, v_dot = ca.SX.sym("tau", g.nt), ca.SX.sym("v_dot", g.nv)
    q = ca.vertsplit(g.q)
    factor = g.module.ldl_factor(g.module.mass_matrix(g.fields, q=q)["H"], g.nv, g.nv)
    bias = ca.vertcat(*g.module.bias_force(g.fields, q=q, v=ca.vertsplit(g.v))["force"])

    def solve(column):
        return ca.vertcat(*g.module.ldl_solve(factor, ca.vertsplit(column), g.nv))

    solved = solve(ca.vertcat(ca.SX(6, 1), tau) - bias)
    directions = [g.q[7:], g.v[3:]] + ([] if turn_by_hand else [g.turn])
    J = ca.jacobian(g.force(q if turn_by_hand else g.turned(), v_dot), ca.vertcat(*directions))
    J = ca.horzsplit(ca.substitute(J, v_dot, solved))
    columns = [solve(-ca.densify(column)) for column in J]
    torques = [
        solve(column)
        for column in ca.horzsplit(ca.densify(ca.vertcat(ca.SX(6, g.nt), ca.SX.eye(g.nt))))
    ]
    rest = ca.horzcat(*columns[: 2 * g.nt + 3], *torques)
    if turn_by_hand:
        R = ca.reshape(ca.vertcat(*g.module.quaternion_rotation(q[3:7])[0]), 3, 3).T
        turn = -R @ ca.skew(R.T @ (solved[:3] + ca.vertcat(0, 0, *g.fields["gravity"])))
    else:
        turn = ca.horzcat(*columns[2 * g.nt + 3 :])
    return g.finished(tau, [rest, turn])


def hessian(model: st.Model) -> ca.Function:
    """Second derivatives of lambda^T ID in SX: lower triangle for turn, tail, omega, rates; rows of
    v_dot for q.
    """
    g = Graph(model)
    both = ca.SX.sym("v_dot_and_multiplier", 2 * g.nv)
    v_dot, multiplier = ca.vertsplit(both, g.nv)
    power = ca.dot(multiplier, g.force(g.turned(), v_dot))
    of_q = ca.vertcat(g.turn, g.q[7:])
    directions = ca.vertcat(of_q, g.v[3:])
    second = ca.jacobian(ca.cse(ca.gradient(power, directions)), directions)
    mixed = ca.jacobian(ca.cse(ca.gradient(power, both)[: g.nv]), of_q)
    return g.finished(both, [ca.tril(second), mixed])


def in_casadi(name: str, function: ca.Function, model: st.Model, folder: Path) -> InCasadi | None:
    """Return the compiled function; None where gcc takes too long."""
    try:
        return InCasadi(name, function, model, folder)
    except subprocess.TimeoutExpired:
        return None

"""CasADi's own C of forward dynamics, its Jacobians and the Hessian, as closures to time."""

import ctypes
from pathlib import Path

import casadi as ca
import numpy as np

import serpentail as st
from benchmarks.peers.build import Compiler, build_library, by_each
from benchmarks.timing import Closure

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
    """A CasADi function of (q, v, rest, parameters) as compiled C, for the timer."""

    def __init__(self, source: Path, function: ca.Function, model: st.Model, compiler: Compiler):
        """Compile; TookTooLong where that takes too long."""
        library = build_library(source, compiler, ("-lm",))
        self.function = ctypes.CDLL(str(library)).measured
        sizes = lengths(function, model)
        held = ("parameters", "out", "work", "integers")
        self.context = np.zeros(sum(sizes[name] for name in held) + 2)
        self.context[: sizes["parameters"]] = model.parameter_vector
        self.out = self.context[sizes["parameters"] :][: sizes["out"]]
        self.sparsities = [function.sparsity_out(k) for k in range(2)]

    @property
    def closure(self) -> Closure:
        """What the timer calls."""
        address = ctypes.cast(self.function, ctypes.c_void_p).value
        return Closure(address, self.context.ctypes.data)

    def __call__(self, *arrays) -> list[np.ndarray]:
        """Both matrices."""
        arrays = [np.ascontiguousarray(array) for array in (*arrays, np.zeros(1))]
        addresses = [ctypes.c_void_p(array.ctypes.data) for array in (self.context, *arrays)]
        if self.function(*addresses):
            raise FloatingPointError("CasADi's C reports a failure")
        first = self.sparsities[0].nnz()
        parts = zip(self.sparsities, (self.out[:first], self.out[first:]), strict=True)
        return [ca.DM(sparsity, values).full() for sparsity, values in parts]


def lengths(function: ca.Function, model: st.Model) -> dict[str, int]:
    """Return the lengths of the arrays that a function is called with."""
    first, second = function.nnz_out(0), function.nnz_out(1)
    sizes = {"parameters": len(model.parameter_vector), "out": first + second, "first": first}
    sizes |= {"work": function.sz_w(), "integers": function.sz_iw()}
    return sizes | {"arguments": max(4, function.sz_arg()), "results": max(2, function.sz_res())}


class Graph:
    """Symbols of a state of one model, and its equations of motion as SX expressions of them."""

    def __init__(self, model: st.Model):
        self.module, self.nv, self.nt = model.checked.casadi_module, model.nv, model.nv - 6
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
        computed once; of a sparse result it writes what is not zero.
        """
        results = ca.cse(ca.substitute(results, [self.turn], [ca.SX.zeros(3)]))
        return ca.Function("differentiated", [self.q, self.v, rest, self.parameters], results)


def acceleration(model: st.Model) -> ca.Function:
    """Return v_dot, and an empty second output, because the timer's adapter needs two."""
    g = Graph(model)
    tau = ca.SX.sym("tau", g.nt)
    arguments = {name: ca.vertsplit(x) for name, x in (("q", g.q), ("v", g.v), ("tau", tau))}
    v_dot = ca.vertcat(*g.module.forward_dynamics(g.fields, **arguments)["v_dot"])
    return g.finished(tau, [v_dot, ca.SX.zeros(1)])


def jacobians(model: st.Model) -> ca.Function:
    """-H^-1 dID in SX: columns of tail coordinates, omega and rates, torques; then those of a turn
    of the torso, by hand: it moves p_b_ddot + g z along and leaves all else.
    """
    g = Graph(model)
    tau, v_dot = ca.SX.sym("tau", g.nt), ca.SX.sym("v_dot", g.nv)
    q = ca.vertsplit(g.q)
    factor = g.module.ldl_factor(g.module.mass_matrix(g.fields, q=q)["H"], g.nv, g.nv)
    bias = ca.vertcat(*g.module.bias_force(g.fields, q=q, v=ca.vertsplit(g.v))["force"])

    def solve(column):
        return ca.vertcat(*g.module.ldl_solve(factor, ca.vertsplit(column), g.nv))

    solved = solve(ca.vertcat(ca.SX(6, 1), tau) - bias)
    J = ca.jacobian(g.force(q, v_dot), ca.vertcat(g.q[7:], g.v[3:]))
    J = ca.horzsplit(ca.substitute(J, v_dot, solved))
    columns = [solve(-ca.densify(column)) for column in J]
    unit = ca.horzsplit(ca.densify(ca.vertcat(ca.SX(6, g.nt), ca.SX.eye(g.nt))))
    rest = ca.horzcat(*columns, *(solve(column) for column in unit))
    R = ca.reshape(ca.vertcat(*g.module.quaternion_rotation(q[3:7])[0]), 3, 3).T
    turn = -R @ ca.skew(R.T @ (solved[:3] + ca.vertcat(0, 0, *g.fields["gravity"])))
    return g.finished(tau, [ca.densify(rest), ca.densify(turn)])


def hessian(model: st.Model) -> ca.Function:
    """Return second derivatives of lambda^T ID in SX: the four square blocks that the generated
    function writes, side by side, and an empty second output.
    """
    g = Graph(model)
    both = ca.SX.sym("v_dot_and_multiplier", 2 * g.nv)
    v_dot, multiplier = ca.vertsplit(both, g.nv)
    power = ca.dot(multiplier, g.force(g.turned(), v_dot))
    of_q = ca.vertcat(g.turn, g.q[7:])
    directions = ca.vertcat(of_q, g.v[3:])
    second = ca.tril(ca.jacobian(ca.cse(ca.gradient(power, directions)), directions))
    mixed = ca.jacobian(ca.cse(ca.gradient(power, both)[: g.nv]), of_q)
    whole, k = ca.tril2symm(second), g.nv - 3

    def square(block):
        return ca.vertcat(ca.SX(3, g.nv), ca.horzcat(ca.SX(k, 3), block))

    squares = [square(block) for block in (whole[:k, :k], whole[:k, k:], whole[k:, k:])]
    blocks = ca.horzcat(*squares, ca.horzcat(ca.SX(g.nv, 3), mixed))
    return g.finished(both, [ca.densify(blocks), ca.SX(0, 0)])


def in_casadi(
    name: str, function: ca.Function, model: st.Model, folder: Path
) -> dict[str, InCasadi]:
    """Return the compiled function by each compiler that finishes it."""
    source = folder / f"{model.name}_{name}.c"
    function.generate(source.name, {"with_header": False})  # into the working folder
    text = Path(source.name).read_text() + CASADI_CALL.format(**lengths(function, model))
    source.write_text(text)
    Path(source.name).unlink()
    return by_each(lambda compiler: InCasadi(source, function, model, compiler))

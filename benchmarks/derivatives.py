"""Derivatives in C beside Pinocchio's and CasADi's: models go in, run times, sizes, build times
come out.
"""

import ctypes
import importlib.util
import resource
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import casadi as ca
import numpy as np

import serpentail as st
from benchmarks.fixtures import Fixture, fixture
from benchmarks.peers import pinocchio as peers
from serpentail.model.compiler import compile_library
from serpentail_codegen.scene.signatures.table import DERIVATIVES

SIZES = ((1, 3), (3, 4), (6, 6))
ROUNDS, CALLS = 200, 64
CASADI_FLAGS = ("-O2", "-march=native", "-fPIC", "-shared")
PATIENCE = 240  # seconds for gcc on one of CasADi's files
OVER = f"over {PATIENCE} s"
JACOBIANS, HESSIAN = "forward_dynamics_derivatives", "inverse_dynamics_hessian"
IN_SX = ("mass_matrix", "bias_force", "inverse_dynamics")  # what CasADi differentiates
CASADI_CALL = """
struct context {{ double parameters[{parameters}], out[{out}], work[{work} + 1]; long long integers[{integers} + 1]; }};
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


# ---- models and closures -------------------------------------------------------------------------


def generated(parent: Path, size: tuple[int, int], functions, emission: str = "auto") -> Path:
    """Generate an articulated tail with some functions; return the generated folder."""
    name = f"{functions[-1]}_m{size[0]}_n{size[1]}"
    scene = parent / f"{name}.toml"
    lines = [
        'kind = "articulated"',
        f"segments = {size[0]}",
        f"links = {size[1]}",
        f"functions = {list(functions)}",
    ]
    scene.write_text("\n".join([*lines, f'emission = "{emission}"', ""]))
    command = [sys.executable, "-m", "serpentail_codegen", str(scene), "--output", str(parent)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return parent / name


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
    def closure(self) -> peers.Closure:
        """What the timer calls."""
        return peers.Closure(
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
    name = f"{model.name}_casadi"
    spec = importlib.util.spec_from_file_location(name, model.folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


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


# ---- measures ------------------------------------------------------------------------------------


def jacobian_times(folder: Path) -> list[dict]:
    """Nanoseconds of the Jacobians of v_dot from (q, v, tau), forward dynamics included, rounds
    interleaved.

    Ratios by minima (by medians in brackets).  Pinocchio, full chain of 2 m n revolutes: v_dot,
    computeRNEADerivatives
    there, G^T (...) G, Cholesky; as its documentation shows it, and with all that was found to
    speed it up
    (pinocchio_derivatives.cpp); own sums over the tied columns on its types.  CasADi: C of the SX
    graph of -H^-1 dID,
    cse, gcc -O2 -march=native, by its Jacobian along all directions and with the columns of a turn
    written by hand.
    Differences: of the documented path, which loses two digits as B is a metre from the origin; the
    largest of the
    others.
    """
    return [jacobian_row(folder, size) for size in SIZES]


def jacobian_row(folder: Path, size: tuple[int, int]) -> dict:
    """Measure one size."""
    ours = fixture(generated(folder, size, (*IN_SX, JACOBIANS)), folder, JACOBIANS)
    by_hand = in_casadi("by_hand", jacobians(ours.model, True), ours.model, folder)
    by_itself = by_hand and in_casadi(
        "by_itself", jacobians(ours.model, False), ours.model, folder
    )  # the larger text
    states = peers.random_states(size[0])
    libraries = (
        peers.build_library(source, peers.CACHE) for source in (peers.PLAIN, peers.DERIVATIVES)
    )
    plain, tuned = (peers.PinocchioBench(*size, ours.parameters, library) for library in libraries)
    with plain, tuned:
        found = {"plain": plain.derivatives_closure, "revolutes": tuned.derivatives_closure}
        found["own"] = tuned.own_derivatives_closure
        found |= {"casadi": by_itself and by_itself.closure, "hand": by_hand and by_hand.closure}
        row = {"model": f"({size[0]}, {size[1]})"} | compared(ours, found, states)
        row["gcc_s"] = by_itself.seconds if by_itself else OVER
        row["plain_difference"] = pinocchio_difference(ours.model, plain, states)
        errors = [pinocchio_difference(ours.model, tuned, states, path) for path in ("", "_own")]
    errors += [casadi_difference(ours.model, peer, states) for peer in (by_itself, by_hand) if peer]
    row["jacobian_difference"] = max(errors)
    return row


def compared(ours: Fixture, others: dict[str, peers.Closure | None], states: peers.States) -> dict:
    """Time all in one go; a peer that is None is one that gcc did not finish."""
    there = {name: closure for name, closure in others.items() if closure}
    times = peers.time_rounds([ours.closure, *there.values()], states, ROUNDS, CALLS)
    own, found = times[0], dict(zip(there, times[1:], strict=True))
    row = {"ns": own[0], "median_ns": own[1]}
    for name in others:
        least, median = found.get(name, (None, None))
        row[f"{name}_ns"] = least or OVER
        row[f"{name}_ratio"] = f"{least / own[0]:.1f}x ({median / own[1]:.1f}x)" if least else ""
    return row


def pinocchio_difference(
    model: st.Model, peer: peers.PinocchioBench, states: peers.States, path: str = ""
) -> float:
    """Largest difference in the rows of omega and the tail, whose columns are the same relative to
    the torso.
    """
    errors = []
    for state in zip(*states, strict=True):
        found = peer.forward_dynamics_derivatives(*state, path)
        for a, b, first in zip(
            model.forward_dynamics_derivatives(*state), found, (6, 3, 0), strict=True
        ):
            errors.append(difference(a[3:, first:], b[3:, first:]))
    return max(errors)


def casadi_difference(model: st.Model, peer: InCasadi, states: peers.States) -> float:
    """Largest difference in all that is not zero."""
    nt, errors = model.nv - 6, []
    for state in zip(*states, strict=True):
        dq, dv, dtau = model.forward_dynamics_derivatives(*state)
        rest, turn = peer(*state)
        parts = np.hsplit(rest, (nt, 2 * nt + 3))
        turn = np.vstack([turn, np.zeros((model.nv - len(turn), 3))])
        pairs = [(dq[:, 3:], np.hstack([turn, parts[0]])), (dv[:, 3:], parts[1]), (dtau, parts[2])]
        errors += [difference(*pair) for pair in pairs]
    return max(errors)


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference of two blocks, relative to the largest entry."""
    return float(np.abs(a - b).max() / np.abs(a).max())


def hessian_times(folder: Path) -> list[dict]:
    """Nanoseconds of the Hessian of lambda^T (H v_dot + C) from C, all blocks that are not zero,
    rounds interleaved.

    CasADi: SX, Jacobian of the gradient, its lower triangle only, and the mixed block; cse, gcc -O2
    -march=native. Ratio by minima (by medians in brackets).
    """
    rows = []
    for size in SIZES[:2]:
        ours = fixture(generated(folder, size, (*IN_SX, HESSIAN)), folder, HESSIAN)
        peer = in_casadi("hessian", hessian(ours.model), ours.model, folder)
        states = multiplied(peers.random_states(size[0]))
        row = {"model": f"({size[0]}, {size[1]})"} | compared(
            ours, {"casadi": peer and peer.closure}, states
        )
        row["gcc_s"] = peer.seconds if peer else OVER
        row["hessian_difference"] = hessian_difference(ours.model, peer, states) if peer else ""
        rows.append(row)
    return rows


def multiplied(states: peers.States) -> peers.States:
    """The states with an acceleration and multipliers in place of torques."""
    rng = np.random.default_rng(0)
    shape = states.v.shape
    return states._replace(tau=np.hstack([rng.uniform(-100, 100, shape), rng.normal(size=shape)]))


def hessian_difference(model: st.Model, peer: InCasadi, states: peers.States) -> float:
    """Largest difference in the lower triangle and the mixed block."""
    errors = []
    for q, v, both in zip(*states, strict=True):
        qq, qv, vv, aq = model.inverse_dynamics_hessian(q, v, *np.split(both, 2))
        whole = np.block([[qq[3:, 3:], qv[3:, 3:]], [qv[3:, 3:].T, vv[3:, 3:]]])
        second, mixed = peer(q, v, both)
        errors += [difference(np.tril(whole), second), difference(aq[:, 3:], mixed)]
    return max(errors)


def derivative_code(folder: Path) -> list[dict]:
    """All ten derivative functions as loops: operations that a call executes, size of their C,
    processor seconds.

    Generating is one process from its start; compiling is all that the compiler takes, with the
    runtime's flags.
    """
    rows = []
    for size in (*SIZES, (8, 16)):
        before = children_seconds()
        model = generated(folder, size, DERIVATIVES, "loops")
        generate = children_seconds() - before
        sources = [model / "src" / f"{model.name}{ending}.c" for ending in ("", "_host")]
        before = children_seconds()
        compile_library(sources, model / "include", cache=folder / f"empty_{model.name}")
        spent = children_seconds() - before
        counts = st.load(model, compiled=False).manifest["functions"]
        row = {"model": f"({size[0]}, {size[1]})"}
        row |= {
            f"{name}_operations": counts[name]["operations"]
            for name in (JACOBIANS, "inverse_dynamics_derivatives", HESSIAN)
        }
        row |= {
            "derivative_bytes": sources[0].stat().st_size,
            "generate_cpu": generate,
            "compile_cpu": spent,
        }
        rows.append(row)
    return rows


def children_seconds() -> float:
    """Processor seconds of all processes started here that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime

"""``casadi.external``: a scene's C functions go in; what CasADi can call of them, derivatives
included, comes out.

CasADi looks for ``jac_f``, ``adj1_f`` and ``jac_adj1_f`` beside ``f``.  It differentiates by the
four numbers of the quaternion, the C functions by a turn of the torso: turn = T d(quaternion), T
(3, 4) = 2 vec(conj(q) .) / |q|^2.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import partial

from ...functions.catalogue import CATALOGUE
from ...functions.tail import Tail, struct_parameters
from ...scene.scene import Scene
from ...scene.signatures.table import SIGNATURES

VECTOR = 8  # doubles in a cache line
# where the numbers begin that anything depends on: neither the position of B nor its velocity
# matters
MOVING = {"q": 3, "v": 3}
Nonzero = Callable[[int, int], bool]


def everywhere(row: int, column: int) -> bool:
    """Tell that a matrix is dense."""
    return True


def nowhere(row: int, column: int) -> bool:
    """Tell that a matrix is zero."""
    return False


def pattern(rows: int, columns: int, nonzero: Nonzero = everywhere) -> tuple[int, ...]:
    """Return a sparsity pattern as CasADi reads it: the size, then 1 if dense, else column starts
    and rows.
    """
    found = [[r for r in range(rows) if nonzero(r, c)] for c in range(columns)]
    if sum(map(len, found)) == rows * columns:
        return (rows, columns, 1)
    starts = [sum(map(len, found[:c])) for c in range(columns + 1)]
    return (rows, columns, *starts, *(r for column in found for r in column))


def moves(name: str, k: int) -> bool:
    """Tell if something depends on number k of an input."""
    return k >= MOVING.get(name, 0)


@dataclass(frozen=True)
class Port:
    """An input or output of a CasADi function: where its numbers lie in a dense array, if
    anywhere.
    """

    name: str
    pattern: tuple[int, ...]
    source: str = ""
    row: int = 1  # distance of neighbours in a column
    column: int = 1  # and in a row
    differentiable: bool = True


@dataclass
class External:
    """One function for CasADi: its ports, and lines of C from arrays of its inputs to arrays of its
    outputs.
    """

    symbol: str
    doc: str
    tail: Tail
    prefix: str
    works: dict[str, int]
    inputs: list[Port] = field(default_factory=list)
    outputs: list[Port] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    arrays: dict[str, int] = field(default_factory=dict)
    helpers: set[str] = field(default_factory=set)
    inner_work: int = 0

    def call(self, name: str, *arguments: str) -> None:
        """Call a function of the model."""
        function = CATALOGUE[name].of(self.tail)
        for a, given in zip((*function.inputs, *function.outputs), arguments, strict=True):
            self.arrays.setdefault(given, a.length(self.tail))
        self.inner_work = max(self.inner_work, self.works[name])
        text = f"{self.prefix}_{name}(&parameters, {', '.join(arguments)}, work)"
        self.lines += [f"if ({text} != {self.prefix.upper()}_OK) {{", "  return 1;", "}"]

    def use(self, helper: str, *arguments, **made: int) -> None:
        """Call a helper of the template, which fills new arrays of the given lengths."""
        self.arrays |= made
        self.helpers.add(helper)
        self.lines.append(
            f"{self.prefix}_casadi_{helper}({', '.join(map(str, (*arguments, *made)))});"
        )

    def unknown(self, name: str) -> None:
        """Make an array of one number that is none."""
        self.arrays[name] = 1
        self.lines.append(f"*{name} = (real)NAN;")

    def places(self) -> dict[str, int]:
        """Return where each array begins: whole cache lines apart."""
        found, first = {}, 0
        taken = {port.source: port.pattern[0] for port in self.inputs if port.source}
        for name, length in (taken | self.arrays).items():
            found[name], first = first, first + -(-length // VECTOR) * VECTOR
        return found | {"work": first}

    @property
    def size(self) -> int:
        """Reals of workspace, with what it takes to begin at a cache line."""
        return self.places()["work"] + self.inner_work + VECTOR - 1


# ---- functions as they are -----------------------------------------------------------------------


def plain(start, name: str, sizes: dict[str, int]) -> External:
    """Return a function of the model with dense ports."""
    e = start(name, "")
    function = CATALOGUE[name].of(e.tail)
    names = [a.name for a in (*function.inputs, *function.outputs)]
    e.call(name, *names)
    fixed = any(
        f.name == name and f.has(e.works, "jac_") and not f.by_parameters(e.works) for f in DYNAMICS
    )
    e.inputs = [Port(a.name, pattern(a.length(e.tail), 1), a.name) for a in function.inputs]
    e.inputs.append(Port("parameters", pattern(sizes["parameters"], 1), differentiable=not fixed))
    for a in function.outputs:
        columns = a.shape(e.tail)[-1] if len(a.shape(e.tail)) > 1 else 1
        e.outputs.append(
            Port(a.name, pattern(a.length(e.tail) // columns, columns), a.name, columns)
        )
    return e


# ---- derivatives ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Dynamics:
    """Inverse or forward dynamics: what it takes last and gives, and which C functions its
    derivatives are made of.
    """

    name: str
    last: str
    gives: str
    jacobian: tuple[str, ...]
    adjoint: tuple[str, ...]
    hessian: tuple[str, ...]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Inputs with derivatives."""
        return ("q", "v", self.last)

    def has(self, works: Collection[str], kind: str) -> bool:
        """Tell if the functions are there that a derivative is made of."""
        parts = {
            "jac_": self.jacobian,
            "adj1_": self.adjoint,
            "jac_adj1_": self.adjoint + self.jacobian + self.hessian,
        }
        return {self.name, *parts[kind]} <= set(works)

    def by_parameters(self, works: Collection[str]) -> bool:
        """Tell if there are derivatives with respect to the parameters."""
        return f"{self.name}_parameter_derivatives" in works

    def depends(self, on: str, row: int, column: int) -> bool:
        """Tell if output ``row`` depends on input ``column``."""
        if on == "v_dot":  # H: the mass in its first corner
            return row == column or max(row, column) >= 3
        if (
            on == "q" and self.name == "forward_dynamics" and column < 7
        ):  # accelerations turn with the torso
            return row < 3 <= column
        return moves(on, column)

    def curved(self, a: str, b: str, row: int, column: int) -> bool:
        """Tell if the derivative of the weighted outputs by number ``row`` of a depends on number
        ``column`` of b.
        """
        if b == f"adj_{self.gives}":
            return self.depends(a, column, row)
        return moves(a, row) and moves(b, column)


DYNAMICS = (
    Dynamics("inverse_dynamics", "v_dot", "force", *SIGNATURES["inverse_dynamics"].exact),
    Dynamics("forward_dynamics", "tau", "v_dot", *SIGNATURES["forward_dynamics"].exact),
)


def first_derivatives(e: External, f: Dynamics) -> dict[str, str]:
    """Compute Jacobians; return the array of each, by input."""
    nv, nq = e.tail.nv, e.tail.nq
    if f.name == "inverse_dynamics":
        e.call("inverse_dynamics_derivatives", "q", "v", "v_dot", "dq", "dv")
        e.call("mass_matrix", "q", "H")
    else:
        e.call("forward_dynamics_derivatives", "q", "v", "tau", "dq", "dv", "dtau")
    e.use("quaternion_columns", "q", nv, "dq", by_q=nv * nq)
    return {"q": "by_q", "v": "dv", f.last: "H" if f.last == "v_dot" else "dtau"}


def by_parameters(e: External, f: Dynamics) -> dict[str, str]:
    """Compute the Jacobian with respect to the parameters, where the model can."""
    if not f.by_parameters(e.works):
        return {}
    e.call(f"{f.name}_parameter_derivatives", "q", "v", f.last, "dparameters")
    return {"parameters": "dparameters"}


def ports_in(f: Dynamics, sizes: dict[str, int], known: bool, order: int) -> list[Port]:
    """Return the inputs of f's Jacobian (order 1), of its adjoint (2), and of the adjoint's
    Jacobian (3).
    """
    names = (*f.inputs, "parameters")
    ports = [
        Port(
            n,
            pattern(sizes[n], 1),
            n if n in f.inputs else "",
            differentiable=n != "parameters" or known,
        )
        for n in names
    ]
    ports.append(Port(f"out_{f.gives}", pattern(sizes[f.gives], 1)))
    if order > 1:
        ports.append(Port(f"adj_{f.gives}", pattern(sizes[f.gives], 1), f"adj_{f.gives}"))
    if order > 2:
        ports += [Port(f"out_adj_{n}", pattern(sizes[n], 1)) for n in names]
    return ports


def jacobian(e: External, f: Dynamics, sizes: dict[str, int]) -> None:
    """Make ``jac_f``."""
    arrays = first_derivatives(e, f) | by_parameters(e, f)
    e.inputs = ports_in(f, sizes, "parameters" in arrays, 1)
    for n in (*f.inputs, "parameters"):
        blocks = pattern(
            sizes[f.gives], sizes[n], partial(f.depends, n) if n in arrays else nowhere
        )
        e.outputs.append(Port(f"jac_{f.gives}_{n}", blocks, arrays.get(n, ""), sizes[n]))


def adjoint(e: External, f: Dynamics, sizes: dict[str, int]) -> None:
    """Make ``adj1_f``."""
    weights = f"adj_{f.gives}"
    e.call(
        f"{f.name}_vjp",
        "q",
        "v",
        f.last,
        weights,
        "turn_gradient",
        "v_gradient",
        f"{f.last}_gradient",
    )
    e.use("quaternion_rows", "q", 1, "turn_gradient", q_gradient=e.tail.nq)
    found = by_parameters(e, f)
    count = sizes["parameters"]
    if found:
        e.use("weighted_rows", count, "dparameters", weights, parameters_gradient=count)
    else:
        e.use("take", "NULL", count, parameters_gradient=count)
    e.inputs = ports_in(f, sizes, bool(found), 2)
    for n in (*f.inputs, "parameters"):
        e.outputs.append(
            Port(
                f"adj_{n}",
                pattern(sizes[n], 1),
                f"{n}_gradient",
                differentiable=n in f.inputs or bool(found),
            )
        )


def tangent_hessian(e: External, f: Dynamics) -> None:
    """Second derivatives of the weighted outputs by velocities: ``qq``, ``qv``, ``vv``, ``aq`` or
    ``tq``.
    """
    weights, blocks = f"adj_{f.gives}", ("qq", "qv", "vv", "aq")
    if f.name == "inverse_dynamics":
        e.call("inverse_dynamics_hessian", "q", "v", "v_dot", weights, *blocks)
    else:
        nv, nt = e.tail.nv, e.tail.nt
        e.call("forward_dynamics", "q", "v", "tau", "v_dot")
        e.call("mass_matrix", "q", "H")
        e.use("solve", "H", weights, mu=nv)
        e.call("inverse_dynamics_hessian", "q", "v", "v_dot", "mu", *blocks)
        e.use("eliminate", "dq", "dv", "dtau", *blocks, tq=nt * nv)


def second_derivatives(e: External, f: Dynamics) -> dict[tuple[str, str], tuple[str, int, int]]:
    """Compute second derivatives; return the array of each block with its strides, by row and
    column.
    """
    nq, nv, weights = e.tail.nq, e.tail.nv, f"adj_{f.gives}"
    last, rows = f.last, nv if f.last == "v_dot" else e.tail.nt
    first = first_derivatives(e, f)
    tangent_hessian(e, f)
    e.use("quaternion_columns", "q", nv, "qq", half=nv * nq)
    e.use("quaternion_rows", "q", nq, "half", by_qq=nq * nq)
    e.use("weighted_rows", nq, "by_q", weights, q_gradient=nq)
    e.use("curvature", "q", "q_gradient", "by_qq")
    e.use("quaternion_rows", "q", nv, "qv", by_qv=nq * nv)
    e.use("quaternion_columns", "q", rows, "aq" if last == "v_dot" else "tq", by_last=rows * nq)
    sources = {
        ("q", "q"): ("by_qq", nq, 1),
        ("q", "v"): ("by_qv", nv, 1),
        ("v", "q"): ("by_qv", 1, nv),
    }
    sources |= {
        ("v", "v"): ("vv", nv, 1),
        (last, "q"): ("by_last", nq, 1),
        ("q", last): ("by_last", 1, nq),
    }
    columns = {"q": nq, "v": nv, last: rows}
    return sources | {(a, weights): (array, 1, columns[a]) for a, array in first.items()}


def hessian(e: External, f: Dynamics, sizes: dict[str, int]) -> None:
    """Make ``jac_adj1_f``; no C function gives second derivatives with respect to parameters: they
    are not a number.
    """
    sources = second_derivatives(e, f)
    known = f.by_parameters(e.works)
    e.inputs = ports_in(f, sizes, known, 3)
    if known:
        e.unknown("unknown")
    for a in (*f.inputs, "parameters"):
        for port in ports_in(f, sizes, known, 2):
            b, shape = port.name, (sizes[a], port.pattern[0])
            if (a, b) in sources:
                blocks, source = pattern(*shape, partial(f.curved, a, b)), sources[a, b]
            elif known and "parameters" in (a, b) and not b.startswith("out_"):
                blocks, source = pattern(*shape), ("unknown", 0, 0)
            else:
                blocks, source = pattern(*shape, nowhere), ()
            e.outputs.append(Port(f"jac_adj_{a}_{b}", blocks, *source))


# ---- a scene's functions -------------------------------------------------------------------------


def externals(scene: Scene, tail: Tail, works: dict[str, int]) -> list[External]:
    """Return every function that CasADi can call, derivatives after the function that they belong
    to.
    """
    sizes = {"q": tail.nq, "v": tail.nv, "v_dot": tail.nv, "force": tail.nv, "tau": tail.nt}
    sizes["parameters"] = sum(p.size for p in struct_parameters(scene))

    def start(name: str, kind: str) -> External:
        symbol, doc = f"{kind}{scene.name}_casadi_{name}", f"{kind}{name}"
        hidden = (
            ()
            if not scene.baked
            else [n for n in works if n.endswith("_parameter_derivatives") and n != name]
        )
        return External(
            symbol, doc, tail, scene.name, {n: work for n, work in works.items() if n not in hidden}
        )

    found = [plain(start, name, sizes) for name in works]
    for f in DYNAMICS:
        for kind, make in (("jac_", jacobian), ("adj1_", adjoint), ("jac_adj1_", hessian)):
            if f.has(works, kind):
                found.append(start(f.name, kind))
                make(found[-1], f, sizes)
    return found


def casadi_context(scene: Scene, tail: Tail, works: dict[str, int]) -> dict:
    """Return what the templates of ``casadi.external`` lay out."""
    made = externals(scene, tail, works) if scene.real == "double" else []
    ports = [port for e in made for port in (*e.inputs, *e.outputs)]
    patterns = sorted({port.pattern for port in ports})
    return {
        "externals": made,
        "patterns": patterns,
        "pattern_of": {found: k for k, found in enumerate(patterns)},
        "casadi_helpers": set().union(*(e.helpers for e in made)),
    }

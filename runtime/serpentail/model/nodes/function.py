"""A model's dynamics at many nodes as one CasADi function of compiled C.

The C (native/nodes.c) is compiled once. Each function has a copy of that library, which is told
how many nodes there are, of which model, and where in memory each number lies.
"""

import ctypes
import shutil
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import casadi
import numpy as np

from ...compiling.cache import cache_folder, workshop
from ...compiling.compiler import compile_library
from ...compiling.threads import threads
from .record import BATCHES, INPUTS, KINDS, PARTS, Nodes, Ports

if TYPE_CHECKING:
    from ..model import Model

NATIVE = Path(__file__).with_name("native")
LINE = 8  # doubles of a cache line
RESULTS = ("forward_dynamics", "inverse_dynamics")
MOST_NODES = 100_000
# about how long a node takes: ns, times this power of nv
COSTS = {"values": (6, 1), "jacobian": (10, 2), "gradient": (10, 2), "hessian": (5, 3)}
WORTH_A_THREAD = 2e5  # ns: to start one takes up to a third of it
_held: list[Any] = []  # what the copies point to: they stay loaded


def nodes_function(model: "Model", name: str, count: int, order: int) -> casadi.Function:
    """Return the dynamics at all nodes, with derivatives up to an order, which the scene allows."""
    nodes = _record(model, name, count, order)
    with workshop(cache_folder(None)) as folder:  # a loaded library needs no file
        path = shutil.copyfile(_library(), folder / "nodes.so")
        library = ctypes.CDLL(str(path))
        library.nodes_configure(ctypes.byref(nodes))
        function = casadi.external(f"nodes{order}", str(path))
    _held.append(library)
    return function


@cache
def _library() -> Path:
    """The compiled C."""
    return compile_library([NATIVE / "nodes.c"], NATIVE, flags=("-pthread",))


def _record(model: "Model", name: str, count: int, order: int) -> Nodes:
    """Return what the C is told."""
    single = model.casadi.external(name)
    nq, nv, last = (single.size1_in(k) for k in range(3))
    own, batches = model.batch_library, _batches(name, order)
    places, block = _places(nq, nv, last)
    nodes = Nodes(
        inverse=name == "inverse_dynamics",
        **{"nq": nq, "nv": nv, "last": last, "count": count, "lanes": own.states, "block": block},
        parameters=single.size1_in(3),
        work=max(own.work[batch] for batch in batches.values()),
    )
    nodes.sizes[:] = nq, nv, last, nv
    nodes.places[:] = [places[part] for part in PARTS]
    nodes.batches[:] = [own.address(batches[key]) if key in batches else None for key in BATCHES]
    for k, (function, sources) in enumerate(_functions(single, places, order)):
        ns, power = COSTS[KINDS[k]]
        worth = int(count * ns * nv**power / WORTH_A_THREAD)
        nodes.kinds[k] = _ports(function, sources, KINDS[k], count)
        nodes.kinds[k].threads = max(1, min(threads(own.threads), worth))
    return nodes


def _batches(name: str, order: int) -> dict[str, str]:
    """Return the model's batches that are needed, by their names in C."""
    found = {"value": name}
    if order > 0:
        found["first"] = f"{name}_derivatives"
    if order > 1 or (order == 1 and name == "inverse_dynamics"):
        found["mass"] = "mass_matrix"
    if order > 1:
        found |= {"product": f"{name}_vjp", "second": "inverse_dynamics_hessian"}
    return found


def _places(nq: int, nv: int, last: int) -> tuple[dict[str, int], int]:
    """Return where each part of a node's block begins, and the block's length.

    Blocks are an odd number of cache lines long: then their lines have different places in caches.
    """
    square, by_q = nv * nv, nv * nq
    lengths = {
        **{"dq": square, "dv": square, "dlast": nv * last, "by_q": by_q},
        **{"turn_gradient": nv, "v_gradient": nv, "last_gradient": last, "gradient_q": nq},
        **{"v_dot": nv, "H": square, "mu": nv},
        **{"qq": square, "qv": square, "vv": square, "aq": square, "tq": nv * last},
        **{"half": by_q, "by_qq": nq * nq, "by_qv": by_q, "by_last": last * nq},
    }
    lines = [-(-lengths[part] // LINE) for part in PARTS]
    begins = np.cumsum([0, *lines])
    places = {part: LINE * int(k) for part, k in zip(PARTS, begins, strict=False)}
    return places, LINE * (int(begins[-1]) | 1)


Source = tuple[int, int, int]  # of a matrix: its place, and how far apart rows and columns are


def _functions(
    single: casadi.Function, places: dict[str, int], order: int
) -> list[tuple[casadi.Function, dict[int, Source]]]:
    """Return the functions of one node, by kind, and where in its block their outputs lie."""
    nq, nv, last = (single.size1_in(k) for k in range(3))
    rows = {
        (0, 0): (places["by_qq"], nq, 1),
        (0, 1): (places["by_qv"], nv, 1),
        (1, 0): (places["by_qv"], 1, nv),
        (1, 1): (places["vv"], nv, 1),
        (2, 0): (places["by_last"], nq, 1),
        (0, 2): (places["by_last"], 1, nq),
    }
    first = ((places["by_q"], nq), (places["dv"], nv), (places["dlast"], last))
    found: list[tuple[casadi.Function, dict[int, Source]]] = [(single, {})]
    if order > 0:
        found.append((single.jacobian(), {k: (*first[k], 1) for k in range(3)}))
    if order > 1:
        adjoint = single.reverse(1)
        gradients = (places["gradient_q"], places["v_gradient"], places["last_gradient"])
        found.append((adjoint, {k: (gradients[k], 1, 1) for k in range(3)}))
        count, weights = adjoint.n_in(), adjoint.n_in() - 1
        rows |= {(k, weights): (place, 1, size) for k, (place, size) in enumerate(first)}
        found.append((adjoint.jacobian(), {a * count + b: row for (a, b), row in rows.items()}))
    return found


def _ports(f: casadi.Function, sources: dict[int, Source], kind: str, count: int) -> Ports:
    """Return the inputs and outputs at all nodes, of those of one node's function."""
    inputs = [_columns(f.sparsity_in(k), f.name_in(k), count) for k in range(f.n_in())]
    outputs, nonzeros, offsets, filled = [], [], [], -1
    matrices = kind in ("jacobian", "hessian")
    for k in range(f.n_out()):
        pattern, own = f.sparsity_out(k), np.zeros(0, np.intc)
        if matrices:
            heights, widths = _repeats(f, k, kind, count)
            if k in sources and pattern.nnz():
                own = _offsets(pattern, sources[k])
                outputs.append(_blocks(pattern, count))
            else:
                outputs.append([pattern.size1() * heights, pattern.size2() * widths])
                outputs[-1] += [0] * (outputs[-1][1] + 1)
        else:
            outputs.append(_columns(pattern, f.name_out(k), count))
            own = _offsets(pattern, sources[k]) if k in sources else own
            filled = k if kind == "gradient" and k not in sources else filled
        nonzeros.append(len(own))
        offsets.append(own)
    weights = {"gradient": 5, "hessian": 5}.get(kind, -1)
    return Ports(
        inputs=f.n_in(),
        outputs=f.n_out(),
        names_in=_pointers([_text(name) for name in f.name_in()]),
        names_out=_pointers([_text(name) for name in f.name_out()]),
        patterns_in=_pointers([np.array(pattern, np.int64) for pattern in inputs]),
        patterns_out=_pointers([np.array(pattern, np.int64) for pattern in outputs]),
        differentiable_in=_address(np.array(f.is_diff_in(), np.intc)),
        differentiable_out=_address(np.array(f.is_diff_out(), np.intc)),
        sources=(ctypes.c_int * len(INPUTS))(0, 1, 2, weights),
        nonzeros=_address(np.array(nonzeros, np.uintp)),
        offsets=_pointers(offsets),
        filled=filled,
        threads=1,
    )


def _repeats(f: casadi.Function, k: int, kind: str, count: int) -> tuple[int, int]:
    """How often the rows and the columns of a derivative are there: once if by the parameters."""
    row, column = (0, k) if kind == "jacobian" else divmod(k, 6)
    by_row = kind == "hessian" and row == 3
    by_column = column == 3
    return 1 if by_row else count, 1 if by_column else count


def _columns(pattern: casadi.Sparsity, name: str, count: int) -> list[int]:
    """The pattern of a dense input or output: a column for each node, one of the parameters."""
    return [pattern.size1(), 1 if name.endswith("parameters") else count, 1]


def _blocks(pattern: casadi.Sparsity, count: int) -> list[int]:
    """The pattern of a block for each node on the diagonal."""
    ends, rows = np.array(pattern.colind()), np.array(pattern.row())
    node = np.arange(count)[:, None]
    starts = (ends[:-1] + node * len(rows)).ravel()
    return [
        *(pattern.size1() * count, pattern.size2() * count),
        *(*starts.tolist(), len(rows) * count),
        *(rows + node * pattern.size1()).ravel().tolist(),
    ]


def _offsets(pattern: casadi.Sparsity, source: Source) -> np.ndarray:
    """Where in a node's block the nonzeros of a matrix lie."""
    rows, columns = map(np.array, pattern.get_triplet())
    place, row, column = source
    return (place + row * rows + column * columns).astype(np.intc)


def _text(name: str) -> np.ndarray:
    return np.frombuffer(name.encode() + b"\0", np.uint8)


def _pointers(arrays: list[np.ndarray]) -> int:
    """The address of an array of pointers to arrays."""
    return _address(np.array([_address(array) for array in arrays], np.uintp))


def _address(array: np.ndarray) -> int:
    _held.append(array)
    return array.ctypes.data

"""Programs of plans in C: values, slopes and curvature of the whole, where a guess begins."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

import serpentail as st
from serpentail.optimal.ipopt import _Sparse
from serpentail.optimal.library import in_c, kernel
from serpentail.optimal.mesh import uniform
from serpentail.optimal.problem import OcpInC
from serpentail.optimal.rules import collocation_rule
from serpentail.optimal.samples import packed
from serpentail.planning.program.build import PlanProgram, plan_program
from serpentail.planning.program.guess import passive, pushes, samples_of
from tests.support.posed import posed
from tests.support.tumbling import DURATION, start


@dataclass(frozen=True)
class WholeProgram:
    """A program of C at w, the variables of all stages, which are a guess at first."""

    made: PlanProgram
    sparse: _Sparse
    w: np.ndarray

    def values(self, w: np.ndarray) -> np.ndarray:
        """Return the objective and all constraints."""
        return np.append(*self.sparse.values(w))

    def slopes(self, w: np.ndarray) -> np.ndarray:
        """Return their Jacobian, dense; nan where there is none."""
        gradient, entries = self.sparse.slopes(w)
        return np.vstack([gradient, self.sparse.jacobian.matrix(entries).full()])

    def curvature(self, w: np.ndarray, weights: np.ndarray) -> np.ndarray | None:
        """Return the Hessian of weights^T values, dense; None where there is none."""
        sparse, sizes = self.sparse, np.zeros((self.made.optimal.stages + 1, 4), np.intc)
        kernel().program_sizes(sparse.program, sizes.ctypes.data)
        columns = sizes[:, :2].sum(axis=1).tolist()
        blocks, lam = np.zeros(sparse.squares), np.ascontiguousarray(weights[1:])
        given = (w.ctypes.data, float(weights[0]), lam.ctypes.data, blocks.ctypes.data)
        if sparse.code.sparse_curve(sparse.program, *given):
            return None
        parts = np.split(blocks, np.cumsum(np.square(columns))[:-1])
        return block_diag(*(part.reshape(n, n) for part, n in zip(parts, columns, strict=True)))


@contextmanager
def whole_program(
    model: st.Model, degree: int = 3, intervals: int = 6, controls: int | None = None, **asked
) -> Iterator[WholeProgram]:
    """Yield the program of a plan on a uniform mesh, at passive flight and a random push.

    asked: of st.plan; functions, if it is given: of the node, instead of the model's own.
    """
    functions, softening = asked.pop("functions", {}), asked.pop("softening", 1e-3)
    problem, _ = posed(model, **{"start": start(model), "duration": DURATION} | asked)
    mesh, rule = uniform(intervals, controls), collocation_rule(degree)
    made = plan_program(model, problem, mesh, rule, softening)
    node = made.optimal.node
    changed = replace(node, airborne=node.airborne | functions)
    made = replace(made, optimal=replace(made.optimal, node=changed))

    push = pushes(np.random.default_rng(1), 1e-3, model)
    motion = passive(model, problem, 1e-4, problem.duration[1], push)
    begin = samples_of(motion, made)
    nodes = np.ascontiguousarray(begin.states[1:].reshape(intervals, degree, -1))
    with in_c(OcpInC(made.optimal, 1.0, 1.0)) as program:
        kernel().program_guess(program, nodes.ctypes.data)
        yield WholeProgram(made, _Sparse(program), packed(made.optimal, begin))

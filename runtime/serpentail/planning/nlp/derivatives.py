"""The program's objective, constraints and exact derivatives, assembled from those of its nodes.

Everything outside the nodes is linear, so each derivative is a sparse matrix times the entries of
the nodes' derivatives.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .node import PARAMETERS, Node
from .node_calls import MappedNode
from .start import StartRows

if TYPE_CHECKING:
    import casadi as ca


@dataclass(frozen=True, eq=False)
class Assembly:
    """f = cost Y + direct w, g = linear w + weights Y, then the node's rows at the start.

    Y (nodes * size): values of the node's function at w[indices] and fractions of every node.
    """

    node: Node
    indices: np.ndarray  # (unknowns of a node, nodes)
    fractions: np.ndarray  # (nodes,) of the duration
    linear: Any  # SciPy's sparse matrix (rows, w)
    weights: Any  # SciPy's sparse matrix (rows, nodes * size)
    cost: np.ndarray
    direct: np.ndarray

    @property
    def start(self) -> StartRows | None:
        """Rows at the start."""
        return self.node.start

    @property
    def rows(self) -> int:
        """Number of constraints."""
        return self.linear.shape[0] + (0 if self.start is None else self.start.rows)

    def functions(self) -> "dict[str, ca.Function]":
        """Return nlp, grad_f, jac_g, hess_lag, with CasADi's names and inputs, and values.

        values: Y (size, nodes).
        """
        import casadi as ca

        # symbols, and the results of all nodes
        w, p = ca.MX.sym("x", len(self.direct)), ca.MX.sym("p", PARAMETERS)
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        derivatives, count = self.node.derivatives, self.indices.shape[1]
        mapped = MappedNode(derivatives, self.fractions)
        Z = ca.reshape(w[self.indices.T.ravel().tolist()], self.indices.shape)
        lam, lam_start = ca.vertsplit(lam_g, [0, self.linear.shape[0], self.rows])
        mu = lam_f * ca.DM(self.cost) + ca.mtimes(_dm(self.weights.T.tocsc()), lam)
        Y, J = ca.vec(mapped.values(Z, p)), mapped.jacobians(Z, p)
        S = mapped.hessians(Z, p, ca.reshape(mu, self.node.size, count))

        # objective and constraints
        f = self._objective(mapped, Z, p, w)
        g = ca.mtimes(_dm(self.linear), w) + ca.mtimes(_dm(self.weights), Y)
        if self.start is not None:
            x = w[: self.start.unknowns.size]
            g = ca.vertcat(g, self.start.function(x))
            J = ca.vertcat(J, _entries(self.start.jacobian(x)))
            S = ca.vertcat(S, _entries(self.start.hessian(x, lam_start)))

        # their derivatives
        pattern, matrix, constant = self._jacobian(*_triplet(derivatives.jacobian.sparsity_out(0)))
        triangle, gather = self._hessian(*_triplet(derivatives.hessian.sparsity_out(0)))
        jac = ca.MX(pattern, ca.mtimes(matrix, J) + constant)
        hess, grad = ca.MX(triangle, ca.mtimes(gather, S)), self._gradient(mapped, Z, p)
        return {
            "values": ca.Function("values", [w, p], [mapped.values(Z, p)]),
            "nlp": ca.Function("nlp", [w, p], [f, g], ["x", "p"], ["f", "g"]),
            "grad_f": ca.Function("nlp_grad_f", [w, p], [f, grad], ["x", "p"], ["f", "grad:f:x"]),
            "jac_g": ca.Function("nlp_jac_g", [w, p], [g, jac], ["x", "p"], ["g", "jac:g:x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l",
                [w, p, lam_f, lam_g],
                [hess],
                ["x", "p", "lam:f", "lam:g"],
                ["triu:hess:gamma:x:x"],
            ),
        }

    def _objective(self, mapped: MappedNode, Z: "ca.MX", p: "ca.MX", w: "ca.MX") -> "ca.MX":
        import casadi as ca

        weights = ca.DM(self.cost.reshape(-1, self.node.size)[:, -1])
        return ca.dot(weights, ca.vec(mapped.costs(Z, p))) + ca.dot(ca.DM(self.direct), w)

    def _gradient(self, mapped: MappedNode, Z: "ca.MX", p: "ca.MX") -> "ca.MX":
        """The objective's gradient: the dynamics has no part in it."""
        import casadi as ca

        _, columns = _triplet(self.node.derivatives.slope.sparsity_out(0))
        index, cost = self.indices[columns].T.ravel(), self.cost.reshape(-1, self.node.size)[:, -1]
        weights = np.repeat(cost, len(columns))
        gather = _sparse(weights, index, np.arange(index.size), (len(self.direct), index.size))
        return ca.mtimes(gather, mapped.slopes(Z, p)) + ca.DM(self.direct)

    def _jacobian(
        self, rows: np.ndarray, columns: np.ndarray
    ) -> "tuple[ca.Sparsity, ca.DM, np.ndarray]":
        """Pattern of the constraints' Jacobian, its map from the nodes' ones, its constant part."""
        count, size = self.indices.shape[1], self.node.size

        # entries of the nodes' Jacobians: their rows (values of Y) and columns (unknowns)
        value = (np.arange(count)[:, None] * size + rows).ravel()
        unknown = self.indices[columns].T.ravel()

        # each enters once for every constraint that has a weight on that value
        start, length = self.weights.indptr[value], np.diff(self.weights.indptr)[value]
        entry = np.repeat(np.arange(unknown.size), length)
        inside = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
        k = start[entry] + inside

        # and those of the rows at the start once
        weight, (row, column) = self.weights.data[k], (self.weights.indices[k], unknown[entry])
        if self.start is not None:
            own_rows, own_columns = _triplet(self.start.jacobian.sparsity_out(0))
            row = np.append(row, self.linear.shape[0] + own_rows)
            column = np.append(column, own_columns)
            entry = np.append(entry, unknown.size + np.arange(own_rows.size))
            weight = np.append(weight, np.ones(own_rows.size))

        # places of all entries, column by column, with those of the linear part
        constant, moved = self.linear.tocoo(), len(row)
        row, column = np.append(row, constant.row), np.append(column, constant.col)
        places = column.astype(np.int64) * self.rows + row
        key, position = np.unique(places, return_inverse=True)
        moving, fixed = position[:moved], position[moved:]
        entries = unknown.size + moved - len(k)
        matrix = _sparse(weight, moving, entry, (len(key), entries))
        return (
            _sparsity(key, (self.rows, len(self.direct))),
            matrix,
            np.bincount(fixed, constant.data, len(key)),
        )

    def _hessian(self, rows: np.ndarray, columns: np.ndarray) -> "tuple[ca.Sparsity, ca.DM]":
        """Pattern of the Lagrangian's Hessian, upper triangle, and its map from the nodes' ones."""
        row, column = self.indices[rows].T.ravel(), self.indices[columns].T.ravel()
        if self.start is not None:
            own_rows, own_columns = _triplet(self.start.hessian.sparsity_out(0))
            row, column = np.append(row, own_rows), np.append(column, own_columns)
        upper = np.flatnonzero(row <= column)
        n = len(self.direct)
        places = column[upper].astype(np.int64) * n + row[upper]
        key, position = np.unique(places, return_inverse=True)
        gather = _sparse(np.ones(len(upper)), position, upper, (len(key), row.size))
        return _sparsity(key, (n, n)), gather


def _entries(matrix: "ca.MX") -> "ca.MX":
    """Entries of a sparse matrix in a column."""
    import casadi as ca

    return ca.vec(matrix.nz[:])


def _triplet(sparsity: "ca.Sparsity") -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of a pattern's entries."""
    rows, columns = sparsity.get_triplet()
    return np.array(rows, int), np.array(columns, int)


def _sparsity(key: np.ndarray, shape: tuple[int, int]) -> "ca.Sparsity":
    """The pattern whose entries are column * rows + row, increasing."""
    import casadi as ca

    columns, rows = np.divmod(key, shape[0])
    ends = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=shape[1]))])
    return ca.Sparsity(*shape, ends.tolist(), rows.tolist())


def _sparse(
    values: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]
) -> "ca.DM":
    from scipy.sparse import csc_matrix

    return _dm(csc_matrix((values, (rows, columns)), shape))


def _dm(matrix: Any) -> "ca.DM":
    """A SciPy matrix as CasADi's."""
    import casadi as ca

    matrix = matrix.tocsc()
    matrix.sort_indices()
    rows, columns = matrix.shape
    pattern = ca.Sparsity(rows, columns, matrix.indptr.tolist(), matrix.indices.tolist())
    return ca.DM(pattern, matrix.data)

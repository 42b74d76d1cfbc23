"""Assembly: a node's function and linear maps go in; a program's functions and exact derivatives
come out.
"""

from dataclasses import dataclass

import numpy as np

from .node import Node
from .node_calls import MappedNode


@dataclass(frozen=True, eq=False)
class Assembly:
    """f = cost Y + direct w, g = linear w + weights Y, Y (nodes * size) being the node's function
    at w[places].
    """

    node: Node
    places: np.ndarray  # (unknowns of a node, nodes)
    linear: object  # sparse (rows, w)
    weights: object  # sparse (rows, nodes * size)
    cost: np.ndarray
    direct: np.ndarray

    def functions(self) -> dict:
        """Return nlp, grad_f, jac_g and hess_lag, with CasADi's names and inputs, and values: Y
        (size, nodes).
        """
        import casadi as ca

        w, h = ca.MX.sym("x", len(self.direct)), ca.MX.sym("p", 3)
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.linear.shape[0])
        one = self.node.derivatives
        mapped = MappedNode(one, self.places.shape[1])
        Z = ca.reshape(w[self.places.T.ravel().tolist()], self.places.shape)
        mu = lam_f * ca.DM(self.cost) + ca.mtimes(_dm(self.weights.T.tocsc()), lam_g)
        Y, J = ca.vec(mapped.values(Z, h)), mapped.jacobians(Z, h)
        S = mapped.hessians(Z, h, ca.reshape(mu, self.node.size, self.places.shape[1]))
        f, g = (
            self._objective(mapped, Z, h, w),
            ca.mtimes(_dm(self.linear), w) + ca.mtimes(_dm(self.weights), Y),
        )
        rows, columns = _pattern(one.jacobian.sparsity_out(0))
        pattern, matrix, constant = self._jacobian(rows, columns)
        triangle, gather = self._hessian(*_pattern(one.hessian.sparsity_out(0)))
        jac = ca.MX(pattern, ca.mtimes(matrix, J) + constant)
        hess, grad = ca.MX(triangle, ca.mtimes(gather, S)), self._gradient(mapped, Z, h)
        return {
            "values": ca.Function("values", [w, h], [mapped.values(Z, h)]),
            "nlp": ca.Function("nlp", [w, h], [f, g], ["x", "p"], ["f", "g"]),
            "grad_f": ca.Function("nlp_grad_f", [w, h], [f, grad], ["x", "p"], ["f", "grad:f:x"]),
            "jac_g": ca.Function("nlp_jac_g", [w, h], [g, jac], ["x", "p"], ["g", "jac:g:x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l",
                [w, h, lam_f, lam_g],
                [hess],
                ["x", "p", "lam:f", "lam:g"],
                ["triu:hess:gamma:x:x"],
            ),
        }

    def _objective(self, mapped: MappedNode, Z, h, w):
        import casadi as ca

        weights = ca.DM(self.cost.reshape(-1, self.node.size)[:, -1])
        return ca.dot(weights, ca.vec(mapped.costs(Z, h))) + ca.dot(ca.DM(self.direct), w)

    def _gradient(self, mapped: MappedNode, Z, h):
        """The objective's gradient: the dynamics has no part in it."""
        import casadi as ca

        _, columns = _pattern(self.node.derivatives.slope.sparsity_out(0))
        place, cost = self.places[columns].T.ravel(), self.cost.reshape(-1, self.node.size)[:, -1]
        weights = np.repeat(cost, len(columns))
        gather = _sparse(weights, place, np.arange(place.size), (len(self.direct), place.size))
        return ca.mtimes(gather, mapped.slopes(Z, h)) + ca.DM(self.direct)

    def _jacobian(self, rows, columns):
        """Pattern of the constraints' Jacobian, the map from the nodes' Jacobians to its entries,
        the constant part.
        """
        count, size = self.places.shape[1], self.node.size
        value_row = (np.arange(count)[:, None] * size + rows).ravel()
        place = self.places[columns].T.ravel()
        start, length = self.weights.indptr[value_row], np.diff(self.weights.indptr)[value_row]
        entry = np.repeat(np.arange(place.size), length)
        inside = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
        k = start[entry] + inside
        constant = self.linear.tocoo()
        row, column = (
            np.concatenate(x)
            for x in ((self.weights.indices[k], constant.row), (place[entry], constant.col))
        )
        key, position = np.unique(
            column.astype(np.int64) * self.linear.shape[0] + row, return_inverse=True
        )
        pattern = _sparsity(key, self.linear.shape)
        moving = position[: len(k)]
        fixed = np.bincount(position[len(k) :], constant.data, len(key))
        return pattern, _sparse(self.weights.data[k], moving, entry, (len(key), place.size)), fixed

    def _hessian(self, rows, columns):
        """Pattern of the upper triangle of the Lagrangian's Hessian, and the map from the nodes'
        ones to it.
        """
        row, column = self.places[rows].T.ravel(), self.places[columns].T.ravel()
        upper = np.flatnonzero(row <= column)
        n = len(self.direct)
        key, position = np.unique(
            column[upper].astype(np.int64) * n + row[upper], return_inverse=True
        )
        return _sparsity(key, (n, n)), _sparse(
            np.ones(len(upper)), position, upper, (len(key), row.size)
        )


def _pattern(sparsity) -> tuple[np.ndarray, np.ndarray]:
    return tuple(np.array(entry, int) for entry in sparsity.get_triplet())


def _sparsity(key: np.ndarray, shape: tuple[int, int]):
    """The pattern whose entries are column * rows + row, increasing."""
    import casadi as ca

    columns, rows = np.divmod(key, shape[0])
    ends = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=shape[1]))])
    return ca.Sparsity(*shape, ends.tolist(), rows.tolist())


def _sparse(values: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]):
    from scipy.sparse import csc_matrix

    return _dm(csc_matrix((values, (rows, columns)), shape))


def _dm(matrix):
    """A SciPy matrix as CasADi's."""
    import casadi as ca

    matrix = matrix.tocsc()
    matrix.sort_indices()
    pattern = ca.Sparsity(*matrix.shape, matrix.indptr.tolist(), matrix.indices.tolist())
    return ca.DM(pattern, matrix.data)

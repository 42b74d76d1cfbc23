"""Calls: functions inside a node's function go in; values and exact derivatives at all nodes come
out.

A node's function is y(zeta, h, e), e being results of calls e = c(L zeta + l).  With E = c' L, its
Jacobian is y_zeta + y_e E, and the Hessian of mu^T y is [I; E]^T (mu^T y)'' [I; E] + L^T (nu^T c)''
L with nu = y_e^T mu.
"""

from dataclasses import dataclass
from itertools import chain


@dataclass(frozen=True, eq=False)
class Call:
    """A CasADi function of one output, and its inputs as (matrix, offset) of zeta."""

    function: object
    inputs: tuple

    @property
    def moving(self) -> list[int]:
        """Inputs that depend on zeta."""
        return [k for k, (matrix, _) in enumerate(self.inputs) if matrix.nnz()]


def linear_call(function, zeta, arguments) -> Call:
    """Return the call of arguments (SX) that are linear in zeta."""
    import casadi as ca

    inputs = []
    for argument in map(ca.SX, arguments):
        matrix = ca.jacobian(argument, zeta)
        parts = ca.Function("parts", [zeta], [matrix, argument])
        matrix, offset = parts(0)
        inputs.append((ca.sparsify(matrix), offset))
    return Call(function, tuple(inputs))


class NodeDerivatives:
    """A node's function and its exact derivatives as CasADi functions of zeta, h and what its calls
    give.
    """

    def __init__(self, node):
        import casadi as ca

        self.node, self.calls, self.function = node, node.calls, node.function
        self.zeta, self.h, *self.results = node.function.sx_in()
        self.y = node.function.call([self.zeta, self.h, *self.results])[0]
        self.jacobians_of_calls = [call.function.jacobian() for call in node.calls]
        self.hessians_of_calls = [call.function.reverse(1).jacobian() for call in node.calls]
        self.cost = ca.Function("cost", [self.zeta, self.h], [self.y[-1]])
        self.slope = ca.Function("slope", [self.zeta, self.h], [ca.jacobian(self.y[-1], self.zeta)])
        self.jacobian, self.weights, self.hessian = (
            self._jacobian(),
            self._weights(),
            self._hessian(),
        )

    def _blocks(self):
        """Symbols of the calls' Jacobians by their moving inputs."""
        import casadi as ca

        return [
            [ca.SX.sym("E", jacobian.sparsity_out(k)) for k in call.moving]
            for call, jacobian in zip(self.calls, self.jacobians_of_calls, strict=True)
        ]

    def _by_zeta(self, blocks):
        """E: derivatives of all results by zeta."""
        import casadi as ca

        rows = []
        for call, parts in zip(self.calls, blocks, strict=True):
            terms = [
                ca.mtimes(part, call.inputs[k][0])
                for k, part in zip(call.moving, parts, strict=True)
            ]
            rows.append(sum(terms[1:], terms[0]))
        return ca.vertcat(*rows)

    def _jacobian(self):
        import casadi as ca

        blocks = self._blocks()
        direct, through = ca.jacobian(self.y, self.zeta), _jacobian_of_parts(self.y, self.results)
        total = direct + ca.mtimes(through, self._by_zeta(blocks))
        return ca.Function(
            "jacobian", [self.zeta, self.h, *self.results, *chain.from_iterable(blocks)], [total]
        )

    def _weights(self):
        """nu of every call."""
        import casadi as ca

        mu = ca.SX.sym("mu", self.node.size)
        total = ca.dot(mu, self.y)
        return ca.Function(
            "weights",
            [self.zeta, self.h, *self.results, mu],
            [ca.gradient(total, r) for r in self.results],
        )

    def _hessian(self):
        import casadi as ca

        mu, blocks = ca.SX.sym("mu", self.node.size), self._blocks()
        everything = ca.vertcat(self.zeta, *self.results)
        inner = ca.hessian(ca.dot(mu, self.y), everything)[0]
        rows = ca.vertcat(ca.SX.eye(self.zeta.size1()), self._by_zeta(blocks))
        total = ca.mtimes([rows.T, inner, rows])
        seconds = []
        for call, hessian in zip(self.calls, self.hessians_of_calls, strict=True):
            for i, j, place in _pairs(call):
                seconds.append(ca.SX.sym("S", hessian.sparsity_out(place)))
                total += ca.mtimes([call.inputs[i][0].T, seconds[-1], call.inputs[j][0]])
        symbols = [self.zeta, self.h, *self.results, mu, *chain.from_iterable(blocks), *seconds]
        return ca.Function("hessian", symbols, [total])


class MappedNode:
    """A node's function at all of `count` nodes: unknowns Z (n, count) and h (3) go in, rows of
    values come out.
    """

    def __init__(self, one: NodeDerivatives, count: int):
        self.one, self.count = one, count

    def _inputs(self, call: Call, Z):
        import casadi as ca

        return [
            ca.mtimes(matrix, Z) + ca.repmat(offset, 1, self.count)
            for matrix, offset in call.inputs
        ]

    def _first(self, Z):
        """Results of all calls, and their Jacobians by the moving inputs."""
        results, blocks = [], []
        for call, jacobian in zip(self.one.calls, self.one.jacobians_of_calls, strict=True):
            inputs = self._inputs(call, Z)
            results.append(call.function.map(self.count)(*inputs))
            found = jacobian.map(self.count).call([*inputs, results[-1]])
            blocks += [found[k] for k in call.moving]
        return results, blocks

    def _repeated(self, h):
        import casadi as ca

        return ca.repmat(h, 1, self.count)

    def values(self, Z, h):
        """Y (size, count)."""
        results = [call.function.map(self.count)(*self._inputs(call, Z)) for call in self.one.calls]
        return self.one.function.map(self.count)(Z, self._repeated(h), *results)

    def costs(self, Z, h):
        """The last row of Y."""
        return self.one.cost.map(self.count)(Z, self._repeated(h))

    def slopes(self, Z, h):
        """Entries of the costs' gradients, node after node."""
        return _entries(self.one.slope.map(self.count)(Z, self._repeated(h)))

    def jacobians(self, Z, h):
        """Entries of the Jacobians, node after node."""
        results, blocks = self._first(Z)
        return _entries(self.one.jacobian.map(self.count)(Z, self._repeated(h), *results, *blocks))

    def hessians(self, Z, h, mu):
        """Entries of the Hessians of mu^T y, node after node; mu (size, count)."""
        import casadi as ca

        results, blocks = self._first(Z)
        nus = self.one.weights.map(self.count).call([Z, self._repeated(h), *results, mu])
        seconds = []
        for call, hessian, result, nu in zip(
            self.one.calls, self.one.hessians_of_calls, results, nus, strict=True
        ):
            unused = [
                ca.MX(hessian.size1_in(k), self.count)
                for k in range(len(call.inputs) + 2, hessian.n_in())
            ]
            found = hessian.map(self.count).call([*self._inputs(call, Z), result, nu, *unused])
            seconds += [found[place] for _, _, place in _pairs(call)]
        return _entries(
            self.one.hessian.map(self.count)(Z, self._repeated(h), *results, mu, *blocks, *seconds)
        )


def _pairs(call: Call) -> list[tuple[int, int, int]]:
    """Moving inputs i, j and the output of the adjoint's Jacobian that has their second
    derivatives.

    The adjoint's outputs are those by input 0, 1, ..; its inputs the call's, its result and the
    weights of that.
    """
    count = len(call.inputs) + 2
    return [(i, j, i * count + j) for i in call.moving for j in call.moving]


def _jacobian_of_parts(y, parts):
    import casadi as ca

    return ca.horzcat(*(ca.jacobian(y, part) for part in parts))


def _entries(matrix):
    """Entries of a sparse matrix in a column."""
    import casadi as ca

    return ca.vec(matrix.nz[:])

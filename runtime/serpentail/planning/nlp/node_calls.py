"""Calls of compiled dynamics inside a node's function, with their exact derivatives.

CasADi cannot see into compiled C, so the chain rule through a call is written out here. A node's
function is y(zeta, p, e), where e = c(L zeta + l) are the results of calls. With E = c' L its
Jacobian is y_zeta + y_e E, and the Hessian of mu^T y is
[I; E]^T (mu^T y)'' [I; E] + L^T (nu^T c)'' L with nu = y_e^T mu.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import casadi as ca

    from .node import Node


@dataclass(frozen=True, eq=False)
class NodeCall:
    """A CasADi function of one output, and its inputs as (matrix, offset) of zeta."""

    function: "ca.Function"
    inputs: "tuple[tuple[ca.DM, ca.DM], ...]"

    @property
    def moving(self) -> list[int]:
        """Inputs that depend on zeta."""
        return [k for k, (matrix, _) in enumerate(self.inputs) if matrix.nnz()]


def linear_call(function: "ca.Function", zeta: "ca.SX", arguments: Iterable[Any]) -> NodeCall:
    """Return the call of arguments (SX, DM) that are linear in zeta."""
    import casadi as ca

    inputs = []
    for argument in map(ca.SX, arguments):
        parts = ca.Function("parts", [zeta], [ca.jacobian(argument, zeta), argument])
        matrix, offset = parts(0)
        inputs.append((ca.sparsify(matrix), offset))
    return NodeCall(function, tuple(inputs))


class NodeDerivatives:
    """Exact derivatives of a node's function, as functions of zeta, p and what its calls give."""

    def __init__(self, node: "Node"):
        import casadi as ca

        self.node, self.calls, self.function = node, node.calls, node.function

        # symbols of the inputs, and y
        self.zeta, self.p, *self.results = node.function.sx_in()
        self.y = node.function.call([self.zeta, self.p, *self.results])[0]

        # derivatives of the calls, of the objective (the last entry of y), and of all of y
        self.jacobians_of_calls = [call.function.jacobian() for call in node.calls]
        self.hessians_of_calls = [call.function.reverse(1).jacobian() for call in node.calls]
        self.cost = ca.Function("cost", [self.zeta, self.p], [self.y[-1]])
        self.slope = ca.Function("slope", [self.zeta, self.p], [ca.jacobian(self.y[-1], self.zeta)])
        self.jacobian = self._jacobian()
        self.weights = self._weights()
        self.hessian = self._hessian()

    def _blocks(self) -> "list[list[ca.SX]]":
        """Symbols of the calls' Jacobians by their moving inputs."""
        import casadi as ca

        return [
            [ca.SX.sym("E", jacobian.sparsity_out(k)) for k in call.moving]
            for call, jacobian in zip(self.calls, self.jacobians_of_calls, strict=True)
        ]

    def _by_zeta(self, blocks: "list[list[ca.SX]]") -> "ca.SX":
        """Return E: derivatives of all results with respect to zeta."""
        import casadi as ca

        rows = []
        for call, parts in zip(self.calls, blocks, strict=True):
            terms = [
                ca.mtimes(part, call.inputs[k][0])
                for k, part in zip(call.moving, parts, strict=True)
            ]
            rows.append(sum(terms[1:], terms[0]))
        return ca.vertcat(*rows)

    def _jacobian(self) -> "ca.Function":
        """y_zeta + y_e E."""
        import casadi as ca

        blocks = self._blocks()
        direct = ca.jacobian(self.y, self.zeta)
        through = ca.horzcat(*(ca.jacobian(self.y, result) for result in self.results))
        total = direct + ca.mtimes(through, self._by_zeta(blocks))
        return ca.Function(
            "jacobian", [self.zeta, self.p, *self.results, *chain.from_iterable(blocks)], [total]
        )

    def _weights(self) -> "ca.Function":
        """nu of every call."""
        import casadi as ca

        mu = ca.SX.sym("mu", self.node.size)
        total = ca.dot(mu, self.y)
        return ca.Function(
            "weights",
            [self.zeta, self.p, *self.results, mu],
            [ca.gradient(total, r) for r in self.results],
        )

    def _hessian(self) -> "ca.Function":
        """The Hessian of mu^T y by zeta."""
        import casadi as ca

        # [I; E]^T (mu^T y)'' [I; E]
        mu, blocks = ca.SX.sym("mu", self.node.size), self._blocks()
        everything = ca.vertcat(self.zeta, *self.results)
        inner = ca.hessian(ca.dot(mu, self.y), everything)[0]
        rows = ca.vertcat(ca.SX.eye(self.zeta.size1()), self._by_zeta(blocks))
        total = ca.mtimes([rows.T, inner, rows])

        # L^T (nu^T c)'' L of every call
        seconds: list[ca.SX] = []
        for call, hessian in zip(self.calls, self.hessians_of_calls, strict=True):
            for i, j, place in _pairs(call):
                seconds.append(ca.SX.sym("S", hessian.sparsity_out(place)))
                total += ca.mtimes([call.inputs[i][0].T, seconds[-1], call.inputs[j][0]])

        symbols = [self.zeta, self.p, *self.results, mu, *chain.from_iterable(blocks), *seconds]
        return ca.Function("hessian", symbols, [total])


class MappedNode:
    """A node's function at all `count` nodes, with unknowns Z (n, count) and parameters p."""

    def __init__(self, node: NodeDerivatives, fractions: np.ndarray):
        self.node, self.count, self.fractions = node, len(fractions), fractions

    def _inputs(self, call: NodeCall, Z: "ca.MX") -> "list[ca.MX]":
        import casadi as ca

        return [
            ca.mtimes(matrix, Z) + ca.repmat(offset, 1, self.count)
            for matrix, offset in call.inputs
        ]

    def _first(self, Z: "ca.MX") -> "tuple[list[ca.MX], list[ca.MX]]":
        """Return results of all calls, and their Jacobians with respect to the moving inputs."""
        results, blocks = [], []
        for call, jacobian in zip(self.node.calls, self.node.jacobians_of_calls, strict=True):
            inputs = self._inputs(call, Z)
            results.append(call.function.map(self.count)(*inputs))
            outputs = jacobian.map(self.count).call([*inputs, results[-1]])
            blocks += [outputs[k] for k in call.moving]
        return results, blocks

    def _parameters(self, p: "ca.MX") -> "ca.MX":
        """p of each node, and its fraction of the duration."""
        import casadi as ca

        return ca.vertcat(ca.repmat(p, 1, self.count), ca.DM(self.fractions[None]))

    def values(self, Z: "ca.MX", p: "ca.MX") -> "ca.MX":
        """Y (size, count)."""
        results = [
            call.function.map(self.count)(*self._inputs(call, Z)) for call in self.node.calls
        ]
        return self.node.function.map(self.count)(Z, self._parameters(p), *results)

    def costs(self, Z: "ca.MX", p: "ca.MX") -> "ca.MX":
        """The last row of Y."""
        return self.node.cost.map(self.count)(Z, self._parameters(p))

    def slopes(self, Z: "ca.MX", p: "ca.MX") -> "ca.MX":
        """Entries of the costs' gradients, node after node."""
        return _entries(self.node.slope.map(self.count)(Z, self._parameters(p)))

    def jacobians(self, Z: "ca.MX", p: "ca.MX") -> "ca.MX":
        """Entries of the Jacobians, node after node."""
        results, blocks = self._first(Z)
        jacobian, own = self.node.jacobian.map(self.count), self._parameters(p)
        return _entries(jacobian(Z, own, *results, *blocks))

    def hessians(self, Z: "ca.MX", p: "ca.MX", mu: "ca.MX") -> "ca.MX":
        """Entries of the Hessians of mu^T y, node after node; mu (size, count)."""
        import casadi as ca

        # results and Jacobians of the calls, and the weights nu of their second derivatives
        results, blocks = self._first(Z)
        own = self._parameters(p)
        nus = self.node.weights.map(self.count).call([Z, own, *results, mu])

        # second derivatives of the calls; of the adjoint's inputs the last ones do not matter
        seconds: list[ca.MX] = []
        for call, hessian, result, nu in zip(
            self.node.calls, self.node.hessians_of_calls, results, nus, strict=True
        ):
            unused = [
                ca.MX(hessian.size1_in(k), self.count)
                for k in range(len(call.inputs) + 2, hessian.n_in())
            ]
            outputs = hessian.map(self.count).call([*self._inputs(call, Z), result, nu, *unused])
            seconds += [outputs[place] for _, _, place in _pairs(call)]
        return _entries(self.node.hessian.map(self.count)(Z, own, *results, mu, *blocks, *seconds))


def _pairs(call: NodeCall) -> list[tuple[int, int, int]]:
    """Moving inputs i, j, and which output of the adjoint's Jacobian has the derivative by both.

    The adjoint's outputs are those by input 0, 1, ..; its inputs are the call's inputs, its result
    and the weights of that.
    """
    count = len(call.inputs) + 2
    return [(i, j, i * count + j) for i in call.moving for j in call.moving]


def _entries(matrix: "ca.MX") -> "ca.MX":
    """Entries of a sparse matrix in a column."""
    import casadi as ca

    return ca.vec(matrix.nz[:])

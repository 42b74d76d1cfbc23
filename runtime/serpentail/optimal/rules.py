"""Collocation rules: the nodes of an interval, and how states are integrated over it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from numpy.typing import ArrayLike

from ..basics.checks import shown
from ..basics.errors import PlanningError
from ..basics.short_repr import brief

USUAL_DEGREE, MOST_DEGREE = 3, 5


@dataclass(frozen=True, eq=False)
class CollocationRule:
    """One interval [0, 1] of a collocation Runge-Kutta method, Radau IIA of a degree K.

    nodes (K,): where the equations hold, the last one at 1. The defects are states (K, K + 1) X -
    h F = 0 with the states X at the start and at the nodes, and the rates F at the nodes; the
    integral of a function over the interval is h weights (K,) times its values at the nodes.
    """

    degree: int
    nodes: np.ndarray
    states: np.ndarray
    weights: np.ndarray
    __repr__ = brief

    @property
    def order(self) -> int:
        """Order of the state's error at the ends of intervals."""
        return 2 * self.degree - 1

    def basis(self, s: ArrayLike) -> np.ndarray:
        """Lagrange polynomials of the nodes (..., K) at s (...) in [0, 1]."""
        return _at(_lagrange(tuple(self.nodes)), s)

    def powers(self) -> np.ndarray:
        """Coefficients of these, (K, degree + 1), of the powers of s, constants first."""
        return np.array([polynomial.coef for polynomial in _lagrange(tuple(self.nodes))])

    def integrals(self, s: ArrayLike) -> np.ndarray:
        """Integrals of these from 0 to s (..., K)."""
        return _integrals(self.nodes, s)


def collocation_rule(degree: int | None = None) -> CollocationRule:
    """Return the rule (Eqs. 41, 42) of a degree, 3 if it is None.

    PlanningError if there is none.
    """
    degree = USUAL_DEGREE if degree is None else degree
    if isinstance(degree, bool) or not isinstance(degree, int) or not 1 <= degree <= MOST_DEGREE:
        raise PlanningError(
            f"degree: value {shown(degree)}: needs a whole number from 1 to {MOST_DEGREE}"
        )
    return _radau(degree)


@cache
def _radau(degree: int) -> CollocationRule:
    """Radau IIA in derivative form, A^-1 (X - X_0) = h F: each rate is in one equation only."""
    nodes = _roots(Legendre.basis(degree) - Legendre.basis(degree - 1))
    A = _integrals(nodes, nodes)
    inverse = np.linalg.inv(A)
    states = np.column_stack([-inverse.sum(axis=1), inverse])
    return CollocationRule(degree, nodes, states, A[-1])


def _roots(series: Legendre) -> np.ndarray:
    """Roots of a series on [-1, 1], polished by Newton's method, moved to [0, 1]."""
    x = np.sort(series.roots().real)
    for _ in range(3):
        x = x - series(x) / series.deriv()(x)
    return (x + 1) / 2


@cache
def _lagrange(nodes: tuple[float, ...]) -> tuple[Polynomial, ...]:
    """Lagrange polynomials of the nodes."""
    polynomials = []
    for k, node in enumerate(nodes):
        others = [other for j, other in enumerate(nodes) if j != k]
        basis = Polynomial.fromroots(others) if others else Polynomial([1.0])
        polynomials.append(basis / np.prod([node - other for other in others]))
    return tuple(polynomials)


def _integrals(nodes: np.ndarray, s: ArrayLike) -> np.ndarray:
    """Integrals of the nodes' Lagrange polynomials from 0 to s (..., K)."""
    return _at([polynomial.integ() for polynomial in _lagrange(tuple(nodes))], s)


def _at(polynomials: Sequence[Polynomial], s: ArrayLike) -> np.ndarray:
    """Values (..., K) of polynomials at s (...)."""
    return np.stack([polynomial(np.asarray(s, float)) for polynomial in polynomials], axis=-1)

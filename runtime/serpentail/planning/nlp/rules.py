"""Collocation rules: the nodes of an interval, and how states are integrated over it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from numpy.typing import ArrayLike

from ...basics.checks import shown
from ...basics.errors import PlanningError
from ...basics.short_repr import brief

# name -> default degree
FAMILIES = {"trapezoidal": 1, "hermite-simpson": 2, "lobatto": 3, "radau": 3}
FIXED = ("trapezoidal", "hermite-simpson")  # those that have no other degree
MOST_DEGREE = 5


@dataclass(frozen=True, eq=False)
class CollocationRule:
    """One interval [0, 1] of a collocation Runge-Kutta method (Radau IIA, Lobatto IIIA).

    nodes (K,): where the equations hold; supports (S + 1,): where the states are unknowns, 0 first.
    The defects are states (S, S + 1) X - h slopes (S, K) F = 0 with the rates F at the nodes; the
    integral of a function over the interval is h weights (K,) times its values at the nodes.
    """

    name: str
    degree: int
    nodes: np.ndarray
    supports: np.ndarray
    states: np.ndarray
    slopes: np.ndarray
    weights: np.ndarray
    __repr__ = brief

    @property
    def steps(self) -> int:
        """Points that an interval adds to a mesh, S."""
        return len(self.supports) - 1

    @property
    def order(self) -> int:
        """Order of the state's error at the ends of intervals."""
        return 2 * self.degree - 1 if self.name == "radau" else 2 * self.degree

    def basis(self, s: ArrayLike) -> np.ndarray:
        """Lagrange polynomials of the nodes (..., K) at s (...) in [0, 1]."""
        return _at(_lagrange(tuple(self.nodes)), s)

    def powers(self) -> np.ndarray:
        """Coefficients of these, (K, degree + 1), of the powers of s, constants first."""
        return np.array([polynomial.coef for polynomial in _lagrange(tuple(self.nodes))])

    def bernstein(self) -> np.ndarray:
        """Coefficients (K, K) in the Bernstein basis of degree K - 1 of a polynomial, times its
        values at the nodes; none is exceeded by the polynomial in the interval.
        """
        degree = len(self.nodes) - 1
        powers = np.zeros((degree + 1, degree + 1))  # of s, in the Bernstein basis
        for i in range(degree + 1):
            for j in range(i + 1):
                powers[i, j] = comb(i, j) / comb(degree, j)
        return powers @ self.powers().T

    def integrals(self, s: ArrayLike) -> np.ndarray:
        """Integrals of these from 0 to s (..., K)."""
        return _integrals(self.nodes, s)


def collocation_rule(name: str, degree: int | None = None) -> CollocationRule:
    """Return a rule; PlanningError if its name is unknown or it does not have this degree.

    "trapezoidal" (the paper's, Eqs. 41, 42), "hermite-simpson" (Lobatto of degree 2), "lobatto"
    (degree + 1 nodes, with both ends), "radau" (degree nodes, with the right end).
    """
    if not isinstance(name, str) or name not in FAMILIES:
        raise PlanningError(f"rule: value {shown(name)}: needs {' or '.join(map(repr, FAMILIES))}")
    degree = FAMILIES[name] if degree is None else degree
    if isinstance(degree, bool) or not isinstance(degree, int) or not 1 <= degree <= MOST_DEGREE:
        raise PlanningError(
            f"degree: value {shown(degree)}: needs a whole number from 1 to {MOST_DEGREE}"
        )
    if name in FIXED and degree != FAMILIES[name]:
        raise PlanningError(
            f"degree: value {shown(degree)}: {name} has {FAMILIES[name]}; leave it out, or use "
            "'radau'"
        )
    return _rule(name, degree)


@cache
def _rule(name: str, degree: int) -> CollocationRule:
    return _radau(name, degree) if name == "radau" else _lobatto(name, degree)


def _radau(name: str, degree: int) -> CollocationRule:
    """Radau IIA in derivative form, A^-1 (X - X_0) = h F: each rate is in one equation only."""
    nodes = _roots(Legendre.basis(degree) - Legendre.basis(degree - 1))
    A = _integrals(nodes, nodes)
    inverse = np.linalg.inv(A)
    states = np.column_stack([-inverse.sum(axis=1), inverse])
    return CollocationRule(
        name, degree, nodes, np.concatenate([[0.0], nodes]), states, np.eye(degree), A[-1]
    )


def _lobatto(name: str, degree: int) -> CollocationRule:
    """Lobatto IIIA in integral form: X - X_0 = h A F."""
    inner = _roots(Legendre.basis(degree).deriv()) if degree > 1 else np.zeros(0)
    nodes = np.concatenate([[0.0], inner, [1.0]])
    A = _integrals(nodes, nodes)
    states = np.column_stack([-np.ones(degree), np.eye(degree)])
    return CollocationRule(name, degree, nodes, nodes, states, A[1:], A[-1])


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

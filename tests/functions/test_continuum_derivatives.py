"""Derivatives of the continuum's CasADi functions are those of its definition in 60 digits, at
every bend.
"""

from functools import cache
from itertools import combinations, pairwise
from math import pi

import casadi
import numpy as np
import pytest

from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import BLOCKS, equilibrated_condition
from tests.references.parameters import TABLE_1, random_states
from tests.support import zoo
from tests.support.rows import row

# rad, of every segment; the range ends at 2 pi
BENDS = {1: (1e-300, 1e-8, 1e-3, 0.1, 1.0, pi), 2: (0.0, 1e-3, 6.28)}
INPUTS = {
    "bias_force": ("q", "v"),
    "inverse_dynamics": ("q", "v", "v_dot"),
    "forward_dynamics": ("q", "v", "tau"),
}
# of the largest derivative in the same rows: smaller blocks of columns are compared with that
NEGLIGIBLE = 1e-6
every_bend = pytest.mark.parametrize(
    ("segments", "bends"),
    [(1, (0.0, 6.28)), *(pytest.param(*x, marks=pytest.mark.slow) for x in BENDS.items())],
    ids=["quick", "m1", "m2"],
)


class Unrounded(ExactContinuum):
    """The exact continuum with numbers of many digits on both sides, and its derivatives by central
    differences.

    With 60 digits, steps of 2^-50 (rad, rad/s, ...) and 20 nodes these are right to 1e-28 up to a
    bend of 2 pi, second ones to 1e-26.
    """

    def __init__(self, segments, digits=60, bits=50, nodes=20):
        super().__init__(TABLE_1, segments, digits, nodes)
        self.step = self.mp.mpf(2) ** -bits

    def _exact(self, vector):
        return np.array([self.mp.mpf(entry) for entry in vector])

    def mass_matrix(self, q):
        """H."""
        return self._mass_matrix(self._jacobian(tuple(q)))

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C."""
        return self._force(self._jacobian(tuple(q)), q, v, v_dot)

    def forward_dynamics(self, q, v, tau):
        """v_dot of H v_dot + C = [0; tau]."""
        force = self._exact([*np.zeros(6), *tau]) - self.bias_force(q, v)
        mass = self.mp.matrix(self.mass_matrix(q).tolist())
        return np.array(list(self.mp.cholesky_solve(mass, self.mp.matrix(force.tolist()))))

    def power(self, weights, q, v, v_dot):
        """weights . (H v_dot + C): the power of all forces in the motion with the rates
        `weights`.
        """
        velocities, accelerations = self._points(q, weights)[1], 2 * self._points(q, v, v_dot)[2]
        spin, omega, omega_dot = (self._exact(x[3:6]) for x in (weights, v, v_dot))
        moment = self.torso_inertia * omega_dot + np.cross(omega, self.torso_inertia * omega)
        return np.sum(self.masses @ (velocities * (accelerations + self.gravity))) + np.dot(
            spin, moment
        )

    def jacobian(self, function, *arguments):
        """Derivatives (*values, inputs) by all entries of all arguments, in this continuum's
        numbers.
        """
        x, parts = self._exact(np.concatenate(arguments)), places(arguments)
        pairs = [(x + e, x - e) for e in self.step * np.eye(len(x))]
        columns = [
            function(*(up[p] for p in parts)) - function(*(down[p] for p in parts))
            for up, down in pairs
        ]
        return np.stack(columns, axis=-1) / (2 * self.step)

    def hessian(self, function, x):
        """Second derivatives (inputs, inputs) of a number, in this continuum's numbers."""
        x, steps = self._exact(x), self.step * np.eye(len(x))
        middle, up, down = (
            function(x),
            [function(x + e) for e in steps],
            [function(x - e) for e in steps],
        )
        twice = np.diag(np.array(up) + down - 2 * middle)
        for i, j in combinations(range(len(x)), 2):
            both = function(x + steps[i] + steps[j]) + function(x - steps[i] - steps[j])
            twice[i, j] = twice[j, i] = (both - up[i] - down[i] - up[j] - down[j] + 2 * middle) / 2
        return twice / self.step**2


def places(arguments):
    """Where each argument lies in the vector of all."""
    return [slice(*ends) for ends in pairwise(np.cumsum([0, *map(len, arguments)]))]


@cache
def exact(segments):
    return Unrounded(segments)


def model(segments):
    """The continuum in CasADi."""
    return zoo.model(f"arcs{segments}")


def state(segments, bend):
    """q, v, v_dot and tau, by name, of a tail whose segments are bent equally, each in a plane of
    its own.
    """
    q, v, v_dot, tau = (rows[0] for rows in random_states(segments, 23, 1, "straight"))
    phi = np.random.default_rng(segments).uniform(0, 2 * pi, segments)
    q[7:] = bend * np.stack([np.cos(phi), np.sin(phi)], axis=1).ravel()
    return {"q": q, "v": v, "v_dot": v_dot, "tau": tau}


def derivatives(segments, name, *arguments):
    """The emitted function's derivatives (values, inputs) by all entries of all arguments."""
    return np.array(_jacobian(segments, name)(*arguments))


@cache
def _jacobian(segments, name):
    function = getattr(model(segments).casadi, name)
    inputs = function.sx_in()
    values = casadi.vec(function(*inputs).T)  # row-major
    return casadi.Function("J", inputs, [casadi.jacobian(values, casadi.vertcat(*inputs))])


def column_blocks(words, arguments):
    """Columns of each part of the arguments: position, quaternion, tail; translation, rotation,
    tail; torques.
    """
    cuts = {"q": (3, 7), "v": (3, 6), "v_dot": (3, 6), "tau": ()}
    blocks = []
    for word, place in zip(words, places(arguments), strict=True):
        edges = [place.start, *(place.start + cut for cut in cuts[word]), place.stop]
        blocks += [slice(*ends) for ends in pairwise(edges)]
    return blocks


def blockwise_error(values, reference, rows, columns):
    """Largest error over pairs of blocks, relative to a pair's largest entry, but see
    NEGLIGIBLE.
    """
    errors = []
    for block in rows:
        floor = NEGLIGIBLE * np.abs(reference[block]).max()
        for column in columns:
            expected = reference[block, column]
            scale = max(np.abs(expected).max(), floor)
            errors.append(np.abs(values[block, column] - expected).max() / scale)
    return np.max(errors)  # not a number, if one of them is none


def first_derivative_error(segments, name, at):
    """blockwise_error of all first derivatives of forces or accelerations."""
    words = INPUTS[name]
    arguments = [at[word] for word in words]
    reference = exact(segments).jacobian(getattr(exact(segments), name), *arguments).astype(float)
    return blockwise_error(
        derivatives(segments, name, *arguments), reference, BLOCKS, column_blocks(words, arguments)
    )


@every_bend
def test_first_derivatives(segments, bends):
    for bend in bends:
        at = state(segments, bend)
        H = exact(segments).mass_matrix(at["q"]).astype(float)
        limits = {
            "bias_force": 1e-13,
            "inverse_dynamics": 1e-13,
            "forward_dynamics": 5e-15 * equilibrated_condition(H),
        }
        for name, limit in limits.items():
            with row(name, bend):
                assert first_derivative_error(segments, name, at) <= limit
        expected = exact(segments).jacobian(exact(segments).mass_matrix, at["q"]).astype(float)
        error = derivatives(segments, "mass_matrix", at["q"]).reshape(expected.shape) - expected
        scale = np.sqrt(np.outer(np.diag(H), np.diag(H)))
        with row("mass_matrix", bend):
            assert np.max(np.abs(error) / scale[:, :, None]) <= 1e-14


@every_bend
def test_second_derivatives_of_a_sum_of_forces(segments, bends):
    """By bends, angular velocity and bend rates; each block of forces has the same weight in the
    sum.
    """
    tail = 2 * segments
    blocks = [slice(0, tail), slice(tail, tail + 3), slice(tail + 3, None)]
    for bend in bends:
        q, v, v_dot, _ = state(segments, bend).values()
        weights = equal_weights(exact(segments).inverse_dynamics(q, v, v_dot).astype(float))

        def arguments(x, joined, q=q, v=v, v_dot=v_dot):
            return joined([q[:7], x[:tail]]), joined([v[:3], x[tail:]]), v_dot

        def power(x, weights=weights, arguments=arguments):
            return exact(segments).power(weights, *arguments(x, np.concatenate))

        x, symbol = np.concatenate([q[7:], v[3:]]), casadi.SX.sym("x", 2 * tail + 3)
        given = arguments(symbol, lambda parts: casadi.vertcat(*parts))
        total = casadi.dot(weights, model(segments).casadi.inverse_dynamics(*given))
        hessian = casadi.Function("hessian", [symbol], [casadi.hessian(total, symbol)[0]])
        expected = exact(segments).hessian(power, x).astype(float)
        with row(bend):
            assert blockwise_error(np.array(hessian(x)), expected, blocks, blocks) <= 1e-13


def equal_weights(force):
    """Random weights of forces, moments and tail torques over the largest of each."""
    weights = np.random.default_rng(5).normal(size=len(force))
    for block in BLOCKS:
        weights[block] /= np.abs(force[block]).max()
    return weights


@pytest.mark.slow
def test_the_references_have_25_digits():
    more, (q, v, v_dot, tau) = Unrounded(1, 80, 66, 24), state(1, 6.28).values()
    few, many = (each.jacobian(each.forward_dynamics, q, v, tau) for each in (exact(1), more))
    assert np.abs(few - many).max() <= 1e-25 * np.abs(many).max()
    few, many = (
        each.hessian(lambda x, each=each: each.power(v, [*q[:7], *x], v, v_dot), q[7:])
        for each in (exact(1), more)
    )
    assert np.abs(few - many).max() <= 1e-25 * np.abs(many).max()


def test_power_is_the_sum_of_forces():
    q, v, v_dot, _ = state(2, 1.0).values()
    force = exact(2).inverse_dynamics(q, v, v_dot)
    assert abs(exact(2).power(v, q, v, v_dot) - np.dot(v, force)) <= 1e-50 * np.dot(
        abs(v), abs(force)
    )

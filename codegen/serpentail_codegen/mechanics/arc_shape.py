"""What bend does to a segment of the continuum tail, by entire functions of the squared bend angle.

The integrals over x of Eqs. 18, 19, which Appendix B writes in sines and powers of 1 / theta, are
here seven form factors, exact rational combinations of Stumpff's functions c_k(z) and c_k(4 z), and
their z-derivatives; `arc` says what sigma, gamma and z are.
"""

from math import factorial

from sympy import Matrix, Rational

from .shapes import V1, V2

HIGHEST = 9  # of Stumpff's functions that the form factors need
SERIES_REACH = 6.4  # rad: up to there TERMS terms leave no more than rounding
TERMS = 16
# form factor: (coefficients k: of c_k(z), coefficients k: of c_k(4 z), order of the highest
# z-derivative)
FACTORS = {
    "s": ({2: 1}, {}, 2),  # integral of sigma
    "g": ({3: 1}, {}, 2),  # of gamma; also half that of sigma^2 + z gamma^2
    "ss": ({}, {3: 2}, 1),  # of sigma^2
    "sg": ({4: -1}, {4: 4}, 1),  # of sigma gamma
    "gg": ({5: -2}, {5: 8}, 1),  # of gamma^2
    "along": ({6: -2, 7: 2}, {7: 32}, 1),  # of 4 (sigma_z^2 + gamma gamma_z + z gamma_z^2)
    "side": ({5: Rational(1, 2)}, {6: -8}, 1),  # of sigma_z gamma - sigma gamma_z
}
SHAPE = tuple(
    name + suffix for name, (*_, top) in FACTORS.items() for suffix in ("", "_z", "_zz")[: top + 1]
)


def z_derivative(near: dict, far: dict) -> tuple[dict, dict]:
    """Differentiate a combination by c_k' = (k c_{k+2} - c_{k+1}) / 2; the argument 4 z gives a
    factor 4.
    """
    out: tuple[dict, dict] = ({}, {})
    for total, terms, inner in zip(out, (near, far), (1, 4), strict=True):
        for k, factor in terms.items():
            for step, weight in ((2, Rational(k, 2)), (1, Rational(-1, 2))):
                total[k + step] = total.get(k + step, 0) + inner * factor * weight
    return out


def series(let, k: int, w):
    """c_k(w) = sum over j of (-w)^j / (2 j + k)!: even and odd terms side by side, by Horner's rule
    in w^2.
    """
    square, halves = let("square", w * w), []
    for first in (0, 1):
        total = Rational(1, factorial(2 * (TERMS - 2 + first) + k))
        for j in range(TERMS - 4 + first, -1, -2):
            total = let("c", Rational(1, factorial(2 * j + k)) + square * total)
        halves.append(total)
    return let("c", halves[0] - w * halves[1])


def ladder(let, w) -> list:
    """c_0 to c_HIGHEST at an argument up to SERIES_REACH^2: series on top, then c_k = 1 / k! - w
    c_{k+2} downward.
    """
    c = [0] * (HIGHEST + 1)
    for k in (HIGHEST, HIGHEST - 1):
        c[k] = series(let, k, w)
    for k in range(HIGHEST - 2, -1, -1):
        c[k] = let("c", Rational(1, factorial(k)) - w * c[k + 2])
    return c


def quadrupled(let, c: list) -> list:
    """c_k(4 w) from c_k(w): the integral of (2 - s)^(k-1) cos(sqrt(w) s) / (k - 1)! over [0, 2],
    cut at 1.
    """
    out = [2 * c[0] * c[0] - 1]
    for k in range(1, HIGHEST + 1):
        near = sum(c[j] * Rational(1, factorial(k - j)) for j in range(1, k + 1))
        far = c[0] * c[k] + c[1] * (c[k - 1] - Rational(1, factorial(k - 1)))
        out.append(let("q", Rational(1, 2**k) * let("sum", near + far)))
    return out


def segment_shape(let, angles: V2, levels: int = 1) -> dict:
    """What bend does to a segment: its form factors, and c_1, c_2, c_3 with z-derivatives, which
    place the tip.

    ``levels`` quadruplings carry the series from z / 4^levels to z, so bends up to SERIES_REACH *
    2^levels are covered.
    """
    a, b = angles
    z = let("z", a * a + b * b)
    c = ladder(let, let("w", z * Rational(1, 4**levels)))
    for _ in range(levels):
        c = quadrupled(let, c)
    c4 = quadrupled(let, c)
    shape = []
    for near, far, highest in FACTORS.values():
        terms = near, far
        for _ in range(highest + 1):
            value = sum(f * c[k] for k, f in terms[0].items()) + sum(
                f * c4[k] for k, f in terms[1].items()
            )
            shape.append(let("factor", value))
            terms = z_derivative(*terms)
    first = [let("c_z", (k * c[k + 2] - c[k + 1]) / 2) for k in (1, 2, 3)]
    second = [
        let("c_zz", (k * (k + 2) * c[k + 4] - (2 * k + 1) * c[k + 3] + c[k + 2]) / 4)
        for k in (1, 2)
    ]
    return {"tip": Matrix([c[1], c[2], c[3], *first, *second]), "shape": Matrix(shape)}


def bend_margin(let, angles: V2, bend_range: V1) -> dict:
    """Positive where a segment is bent by less than the declared range, up to rounding."""
    limit = let("limit", bend_range[0] * bend_range[0] * Rational(10**12 + 1, 10**12))
    return {"margin": [limit - angles[0] ** 2 - angles[1] ** 2]}


def factors(shape) -> dict:
    """Return the form factors by name, and the two halves of sg_z."""
    f = dict(zip(SHAPE, shape, strict=True))
    return f | {"sz_g": (f["sg_z"] + f["side"]) / 2, "s_gz": (f["sg_z"] - f["side"]) / 2}

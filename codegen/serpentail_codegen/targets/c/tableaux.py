"""Integration methods: their coefficients as published, and as the C needs them."""

from dataclasses import dataclass
from fractions import Fraction

Row = tuple[float, ...]


@dataclass(frozen=True)
class Explicit:
    """A Runge-Kutta method.

    Stage s is at t + nodes[s] h, formed with rows[s]; weights give the result and its error.
    """

    nodes: Row
    rows: tuple[Row, ...]
    weights: Row
    error: Row = ()
    coarse: Row = ()  # weights of a second estimate of the error, of a lower order
    # of stage i: weight at the part x of a step, x dense[i][0] + x^2 dense[i][1] + ...
    dense: tuple[Row, ...] = ()


@dataclass(frozen=True)
class Rosenbrock:
    """A Rosenbrock method as it is computed, free of products with J.

    (1 - h gamma J) u_s = h gamma f(t + nodes[s] h, y + sum rows[s] u) + gamma sum couplings[s] u, J
    being any approximation of the rate's Jacobian.
    """

    gamma: float
    nodes: Row
    rows: tuple[Row, ...]
    couplings: tuple[Row, ...]
    weights: Row
    error: Row


RK4 = Explicit(
    (0.0, 0.5, 0.5, 1.0), ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)
)
# Ch. Tsitouras, Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying
# assumption, Comput. Math. Appl. 62 (2011) 770-775; the last stage is the first of the next step,
# the interpolant has order 4.
TSIT5 = Explicit(
    nodes=(0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0),
    rows=(
        (),
        (0.161,),
        (-0.008480655492356989, 0.335480655492357),
        (2.8971530571054935, -6.359448489975075, 4.3622954328695815),
        (5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525),
        (
            5.86145544294642,
            -12.92096931784711,
            8.159367898576159,
            -0.071584973281401,
            -0.028269050394068383,
        ),
        (
            0.09646076681806523,
            0.01,
            0.4798896504144996,
            1.379008574103742,
            -3.290069515436081,
            2.324710524099774,
        ),
    ),
    weights=(
        0.09646076681806523,
        0.01,
        0.4798896504144996,
        1.379008574103742,
        -3.290069515436081,
        2.324710524099774,
        0.0,
    ),
    error=(
        -0.00178001105222577714,
        -0.0008164344596567469,
        0.007880878010261995,
        -0.1447110071732629,
        0.5823571654525552,
        -0.45808210592918697,
        0.015151515151515152,
    ),
    dense=(
        (1.0, -2.763706197274826, 2.9132554618219126, -1.0530884977290216),
        (0.0, 0.13169999999999998, -0.2234, 0.1017),
        (0.0, 3.9302962368947516, -5.941033872131505, 2.490627285651253),
        (0.0, -12.411077166933676, 30.33818863028232, -16.548102889244902),
        (0.0, 37.50931341651104, -88.1789048947664, 47.37952196281928),
        (0.0, -27.896526289197286, 65.09189467479366, -34.87065786149661),
        (0.0, 1.5, -4.0, 2.5),
    ),
)

# E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer
# 1993, II.10: DOP853, by J. R. Dormand and P. J. Prince; estimates of orders 5 and 3.
# fmt: off
DP8 = Explicit(
    nodes=(0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726,
        0.3333333333333333, 0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571,
        1.0),
    rows=(
        (),
        (0.05260015195876773,),
        (0.0197250569845379, 0.0591751709536137),
        (0.02958758547680685, 0, 0.08876275643042054),
        (0.2413651341592667, 0, -0.8845494793282861, 0.924834003261792),
        (0.037037037037037035, 0, 0, 0.17082860872947386, 0.12546768756682242),
        (0.037109375, 0, 0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
        (0.03709200011850479, 0, 0, 0.17038392571223998, 0.10726203044637328,
         -0.015319437748624402, 0.008273789163814023),
        (0.6241109587160757, 0, 0, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
         20.154067550477894, -43.48988418106996),
        (0.47766253643826434, 0, 0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
         15.279233632882423, -33.28821096898486, -0.020331201708508627),
        (-0.9371424300859873, 0, 0, 5.186372428844064, 1.0914373489967295, -8.149787010746927,
         -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196),
        (2.273310147516538, 0, 0, -10.53449546673725, -2.0008720582248625, -17.9589318631188,
         27.94888452941996, -2.8589982771350235, -8.87285693353063, 12.360567175794303,
         0.6433927460157636),
    ),
    weights=(0.054293734116568765, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003,
        -5.801203960010585, 0.3111643669578199, -0.1521609496625161, 0.20136540080403034,
        0.04471061572777259),
    error=(0.01312004499419488, 0, 0, 0, 0, -1.2251564463762044, -0.4957589496572502,
        1.6643771824549864, -0.35032884874997366, 0.3341791187130175, 0.08192320648511571,
        -0.022355307863886294),
    coarse=(-0.18980075407240762, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003,
        -5.801203960010585, -0.4226823213237919, -0.1521609496625161, 0.20136540080403034,
        0.02265179219836082),
)
# fmt: on


@dataclass(frozen=True)
class Classical:
    """A Rosenbrock method as papers state it: alpha, gamma below its diagonal, its diagonal."""

    gamma: float
    alpha: tuple[Row, ...]
    below: tuple[Row, ...]
    weights: Row
    embedded: Row


# J. Rang, L. Angermann, New Rosenbrock W-methods of order 3 for PDAEs of index 1, BIT 45 (2005)
# 761-787: order 3 with any J, order 2 embedded, L-stable and stiffly accurate with the exact J.
ROS34PW2 = Classical(
    gamma=0.435866521508459,
    alpha=(
        (),
        (0.8717330430169180,),
        (0.8445706001536942, -0.11299064236484185),
        (0.0, 0.0, 1.0),
    ),
    below=(
        (),
        (-0.8717330430169180,),
        (-0.9033805701304408, 0.05418067238809533),
        (0.24212380706095346, -1.2232505839045147, 0.5452602553351021),
    ),
    weights=(0.24212380706095346, -1.2232505839045147, 1.5452602553351021, 0.435866521508459),
    embedded=(0.3781090314581937, -0.09604229221242318, 0.5, 0.2179332607542295),
)


def transformed(method: Classical) -> Rosenbrock:
    """Return a method in u = Gamma k (Hairer and Wanner, Eq. IV.7.25), computed without
    rounding.
    """
    size, gamma = len(method.weights), Fraction(method.gamma)
    lower = [[*map(Fraction, row), gamma] for row in method.below]
    inverse = _inverse(lower)

    def times(row: Row) -> Row:
        return tuple(
            float(sum(Fraction(x) * inverse[i][j] for i, x in enumerate(row) if i >= j))
            for j in range(len(row))
        )

    return Rosenbrock(
        gamma=method.gamma,
        nodes=tuple(float(sum(map(Fraction, row))) for row in method.alpha),
        rows=tuple(map(times, method.alpha)),
        couplings=tuple(tuple(float(-inverse[i][j]) for j in range(i)) for i in range(size)),
        weights=times(method.weights),
        error=times(
            tuple(
                float(Fraction(b) - Fraction(e))
                for b, e in zip(method.weights, method.embedded, strict=True)
            )
        ),
    )


def _inverse(lower: list[list[Fraction]]) -> list[list[Fraction]]:
    """Return the inverse of a lower triangular matrix, row by row."""
    size = len(lower)
    inverse = [[Fraction(0)] * size for _ in range(size)]
    for j in range(size):
        inverse[j][j] = 1 / lower[j][j]
        for i in range(j + 1, size):
            inverse[i][j] = -sum(lower[i][k] * inverse[k][j] for k in range(j, i)) / lower[i][i]
    return inverse

"""The effect of forces on the tail's points on torso and joints, and the Jacobians of the
points.
"""

from sympy import Matrix

from .shapes import M33, V3, V6, V12


def load_at_torso(let, R: M33, f_torso: V6, F_beyond: V6) -> dict:
    """All loads at B in torso axes; ``f_torso`` is a force in world axes and a moment in torso
    axes.
    """
    force = R.T * f_torso[0:3, :] + F_beyond[0:3, :]
    return {"load_force": force, "load_moment": f_torso[3:6, :] + F_beyond[3:6, :]}


def load_at_point(let, R: M33, P: V3, f_point: V3, F_beyond: V6) -> dict:
    """Add a world force at a tail point to the wrench at B of all forces from this point to the
    tip.
    """
    force = let("force", R.T * f_point)
    return {"F_beyond": F_beyond + Matrix([force, P.cross(force)])}


def moment_of_places(let, R: M33, places: M33) -> dict:
    """Moment about B in world axes of forces f at places r of the torso, by the sum of r f^T."""
    turned = R * places  # (R r) f^T, whose skew part is R r x f
    pairs = ((1, 2), (2, 0), (0, 1))
    return {"moment": Matrix([turned[a, b] - turned[b, a] for a, b in pairs])}


def joint_load(let, S: V12, F_beyond: V6) -> dict:
    """Generalised force of the tail loads on one joint: J^T f by its spatial columns (Eq. 10)."""
    force, moment = F_beyond[0:3, :], F_beyond[3:6, :]
    starts = range(0, len(S), 6)
    each = [S[k : k + 3, :].dot(moment) + S[k + 3 : k + 6, :].dot(force) for k in starts]
    return {"torque": Matrix(each)}


def point_jacobian_base(let, R: M33, arm: V3) -> dict:
    """d(point)/d omega = -skew(arm) R_b for a point at ``arm`` from B, world axes (Eq. A7, the
    tilde restored).
    """
    # the tilde that the text lacks is that of A8
    return rows(Matrix.hstack(*(R.col(k).cross(arm) for k in range(3))))


def point_jacobian_tail(let, S: V12, arm: V3) -> dict:
    """d(point)/d(alpha_i, beta_i) = S_v + S_omega x arm: velocity of the point under the columns of
    segment i.
    """
    # A8 for the columns of one segment: both lines have a tilde
    starts = range(0, len(S), 6)
    columns = [S[k + 3 : k + 6, :] + S[k : k + 3, :].cross(arm) for k in starts]
    return rows(Matrix.hstack(*columns))


def rows(block) -> dict:
    """Name the x, y and z rows of a 3-row block."""
    return {f"J_{axis}": block.row(r).T for r, axis in enumerate("xyz")}

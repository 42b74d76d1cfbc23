"""Kinematics of the torso and the articulated tail: SymPy vectors in, SymPy vectors out (Sect. 2.2, Appendix A).

Every link recursion is written in link-local frames: a universal joint is a turn about x, then a turn about z
(Eq. 11), and a link lies along -y of its frame (Eq. 15).  ``let`` names an intermediate result, so that expressions
stay small.
"""

from sympy import Matrix, cos, eye, sin, sqrt

X, Y, Z = (Matrix(row) for row in eye(3).tolist())


def rotation_x(c, s) -> Matrix:
    """R_x of Eq. 11 from cosine and sine."""
    return Matrix([[1, 0, 0], [0, c, -s], [0, s, c]])


def rotation_z(c, s) -> Matrix:
    """R_z of Eq. 11 from cosine and sine."""
    return Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def joint_turns(joint) -> tuple[Matrix, Matrix]:
    """Return R_x(alpha) and R_z(beta) of one universal joint."""
    return rotation_x(joint[0], joint[1]), rotation_z(joint[2], joint[3])


def square(R) -> Matrix:
    """Return the 3 x 3 matrix whose nine entries are given row by row."""
    return Matrix(3, 3, list(R))


def quaternion_rotation(let, quaternion) -> dict:
    """R_b from (w, x, y, z); only the direction of the quaternion counts, so it need not be normalised."""
    w, x, y, z = quaternion
    s = let("s", 2 / (w * w + x * x + y * y + z * z))
    sx, sy, sz = let("sq", Matrix([s * x, s * y, s * z]))
    xx, yy, zz = let("d", Matrix([sx * x, sy * y, sz * z]))
    xy, xz, yz, wx, wy, wz = let("e", Matrix([sx * y, sx * z, sy * z, sx * w, sy * w, sz * w]))
    rows = [[1 - (yy + zz), xy - wz, xz + wy], [xy + wz, 1 - (xx + zz), yz - wx], [xz - wy, yz + wx, 1 - (xx + yy)]]
    return {"R": Matrix(rows)}


def unit_quaternion(let, quaternion) -> dict:
    """The quaternion over its norm."""
    norm = let("norm", sqrt(let("square", quaternion.dot(quaternion))))
    return {"unit": quaternion * let("inverse", 1 / norm)}


def turned_quaternion(let, quaternion, turn) -> dict:
    """Rate of a unit quaternion for a rate of turn in body axes: q (0, turn) / 2."""
    w, x, y, z = quaternion
    half = [let("half", entry / 2) for entry in turn]
    rates = [
        -(x * half[0] + y * half[1] + z * half[2]),
        w * half[0] + y * half[2] - z * half[1],
        w * half[1] + z * half[0] - x * half[2],
        w * half[2] + x * half[1] - y * half[0],
    ]
    return {"rate": Matrix(rates)}


def turn_gradient(let, quaternion, gradient) -> dict:
    """Gradient with respect to a turn in body axes, from that with respect to a unit quaternion's four numbers."""
    w, x, y, z = quaternion
    gw, gx, gy, gz = gradient
    twice = [
        w * gx - x * gw + z * gy - y * gz,
        w * gy - y * gw + x * gz - z * gx,
        w * gz - z * gw + y * gx - x * gy,
    ]
    return {"turn": Matrix(twice) / 2}


def joint_trigonometry(let, angles) -> dict:
    """Cosines and sines of (alpha_i, beta_i), once for the n equal joints of segment i."""
    alpha, beta = angles
    return {"joint": Matrix([cos(alpha), sin(alpha), cos(beta), sin(beta)])}


def double_angles(let, joint) -> dict:
    """s^2, s c, 2 s c, c^2 - s^2 and c^2 of both joint angles: what turns a symmetric tensor in the plane."""
    rows = []
    for c, s in (joint[0:2], joint[2:4]):
        sine_squared, product = let("k", Matrix([s * s, s * c]))
        rows += [sine_squared, product, 2 * product, 1 - 2 * sine_squared, c * c]
    return {"twice": Matrix(rows)}


def mount_position(let, R, p, tail_mount) -> dict:
    """p_1,jnt = p_b + R_b p_b2t (Eq. 14)."""
    return {"P": p + square(R) * tail_mount}


def link_pose(let, joint, link, R, P) -> dict:
    """R_j = R_{j-1} R_x R_z (Eqs. 11, 12) and the next joint p_j+1 = p_j - L y_j (Eqs. 14, 15)."""
    turn_x, turn_z = joint_turns(joint)
    mid = let("mid", square(R) * turn_x)
    turned = let("turned", mid * turn_z)
    return {"R": turned, "P": P - link[1] * turned.col(1)}


def joint_twist(let, joint, R, P) -> dict:
    """Spatial columns of one joint at B: (x_{j-1}, p_j x x_{j-1}) and (z_j, p_j x z_j) (Eqs. A5, A7)."""
    turn_x, _ = joint_turns(joint)
    pitch, yaw = square(R).col(0), let("yaw", square(R) * turn_x * Z)
    return {"S": Matrix([pitch, P.cross(pitch), yaw, P.cross(yaw)])}


def link_angular_velocity(let, joint, rates, w) -> dict:
    """omega_j = omega_{j-1} + alpha_dot x_{j-1} + beta_dot z_j (Eq. A1), in the frame of link j."""
    turn_x, turn_z = joint_turns(joint)
    mid = let("mid", turn_x.T * w + rates[0] * X)
    return {"w": turn_z.T * mid + rates[1] * Z}


def link_linear_velocity(let, joint, link, w, u) -> dict:
    """v_jnt of this joint in the frame of link j, and v_j+1,jnt = v_j,jnt - L omega_j x y_j (Eqs. A3, A4)."""
    turn_x, turn_z = joint_turns(joint)
    here = let("here", turn_z.T * let("mid", turn_x.T * u))
    return {"u_joint": here, "u": here - link[1] * w.cross(Y)}


def link_motion(let, joint, rates, accelerations, link, w, w_dot, a) -> dict:
    """omega_j (A1), omega_dot_j (A9), acceleration of this joint and the next (A11, A12), in the frame of link j.

    ``swing`` is omega_dot x y + omega x (omega x y): accelerations along the link are multiples of it.
    """
    turn_x, turn_z = joint_turns(joint)
    w_mid = let("w_mid", turn_x.T * w + rates[0] * X)
    w_dot_mid = let("w_dot_mid", turn_x.T * w_dot + accelerations[0] * X + rates[0] * w_mid.cross(X))
    w_here = let("w_here", turn_z.T * w_mid + rates[1] * Z)
    w_dot_here = let("w_dot_here", turn_z.T * w_dot_mid + accelerations[1] * Z + rates[1] * w_here.cross(Z))
    a_here = let("a_here", turn_z.T * let("a_mid", turn_x.T * a))
    products = let("ww", Matrix([w_here[0] * w_here[1], w_here[0] ** 2 + w_here[2] ** 2, w_here[1] * w_here[2]]))
    swing = let("k", Matrix([products[0] - w_dot_here[2], -products[1], products[2] + w_dot_here[0]]))
    return {"w": w_here, "w_dot": w_dot_here, "a_joint": a_here, "swing": swing, "a": a_here - link[1] * swing}


def torso_velocity(let, R, p_dot) -> dict:
    """v_b in the torso frame."""
    return {"u": square(R).T * p_dot}


def mount_velocity(let, u, w, tail_mount) -> dict:
    """v_1,jnt = v_b + omega_b x p_b2t (Eq. A3) in the torso frame."""
    return {"u": u + w.cross(tail_mount)}


def mount_acceleration(let, w, w_dot, a, tail_mount) -> dict:
    """v_dot_1,jnt of A11 in the torso frame; ``a`` is R_b^T (p_b_ddot + g), gravity being an acceleration of B."""
    return {"a_mount": a + w_dot.cross(tail_mount) + w.cross(let("r", w.cross(tail_mount)))}


def torso_acceleration(let, R, p_ddot, gravity) -> dict:
    """a = R_b^T (p_b_ddot + g z): all that gravity and translation do in flight (Eqs. 3, 17)."""
    return {"a": square(R).T * (p_ddot + gravity[0] * Z)}


def point_jacobian_base(let, R, arm) -> dict:
    """d(point)/d omega = -skew(arm) R_b for a point at ``arm`` from B, world axes (Eq. A7, the tilde restored)."""
    return rows(Matrix.hstack(*(square(R).col(k).cross(arm) for k in range(3))))


def point_jacobian_tail(let, S, arm) -> dict:
    """d(point)/d(alpha_i, beta_i) = S_v + S_omega x arm: velocity of the point under the columns of segment i."""
    columns = [S[3:6, :] + S[0:3, :].cross(arm), S[9:12, :] + S[6:9, :].cross(arm)]
    return rows(Matrix.hstack(*columns))


def rows(block) -> dict:
    """Name the x, y and z rows of a 3-row block."""
    return {f"J_{axis}": block.row(r).T for r, axis in enumerate("xyz")}

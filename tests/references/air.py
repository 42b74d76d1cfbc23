"""Drag on a tail and a torso by sums over Gauss points, whose velocities and Jacobians are complex
steps of their places in the world.
"""

import numpy as np

STEP = 1e-30
POINTS = {"articulated": 3, "continuum": 4}


def about(axis, angle):
    """The rotation about an axis of unit length (Rodrigues), also by a complex angle."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


X, Y, Z = np.eye(3)


def attitude(quaternion):
    """The rotation of a quaternion of any norm."""
    w, x, y, z = quaternion
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(rows) / (quaternion @ quaternion)


def pieces_of(model):
    """Segment, kind and length of each link or arc."""
    p, kinds = model.parameters, model.kinds
    each = model.joints_each.astype(int) if model.links else np.ones(len(kinds), int)
    links, arcs = (iter(np.atleast_1d(p.get(n, ()))) for n in ("link_lengths", "arc_lengths"))
    equal = p["tail_length"] / sum(each)
    own = {"articulated": links, "continuum": arcs}
    counted = [
        (i, kind, int(each[i]) if kind == "articulated" else 1) for i, kind in enumerate(kinds)
    ]
    return [(i, kind, next(own[kind], equal)) for i, kind, count in counted for _ in range(count)]


def places(model, q, shares):
    """Places and axes, world, at shares of each piece: (pieces, shares, 3) twice."""
    p = model.parameters
    fixed = len(q) == model.layout.nt
    R, at = (np.eye(3), np.zeros(3)) if fixed else (attitude(q[3:7]), q[:3])
    at, tail = at + R @ np.array(p["tail_mount"]), q if fixed else q[7:]
    pitch, roll, yaw = p.get("mount_angles", (0, 0, 0))
    R, found = R @ about(Z, yaw) @ about(X, pitch) @ about(Y, roll), []
    for i, kind, length in pieces_of(model):
        a, b = tail[2 * i : 2 * i + 2]
        if kind == "articulated":
            R = R @ about(X, a) @ about(Z, b)
            found.append([(at - s * length * R[:, 1], R[:, 1]) for s in shares[kind]])
            at = at - length * R[:, 1]
            continue
        bend = np.sqrt(a * a + b * b)
        axis, side = np.array([a, 0, b]) / bend, np.array([b, 0, -a]) / bend
        rows = []
        for s in (*shares[kind], 1.0):
            local = -np.sin(s * bend) / bend * Y + (1 - np.cos(s * bend)) / bend * side
            rows.append((at + length * R @ local, (R @ about(axis, s * bend))[:, 1]))
        found.append(rows[:-1])
        at, R = rows[-1][0], R @ about(axis, bend)
    return found


def along(q, v):
    """How q moves with a velocity."""
    if len(q) == len(v):
        return v
    w, x, y, z = q[3:7]
    a, b, c = v[3:6] / 2
    turn = [
        -x * a - y * b - z * c,
        w * a + y * c - z * b,
        w * b + z * a - x * c,
        w * c + x * b - y * a,
    ]
    return np.concatenate([v[:3], turn, v[6:]])


def air_force(model, q, v):
    """Generalised force of the air."""
    p, nv = model.parameters, len(v)
    rules = {kind: np.polynomial.legendre.leggauss(n) for kind, n in POINTS.items()}
    shares = {kind: (1 + x) / 2 for kind, (x, _) in rules.items()}
    still = places(model, q, shares)
    moving = [places(model, q + 1j * STEP * along(q, d), shares) for d in (v, *np.eye(nv))]
    wind, e, widths = np.array(p["wind"]), p["tail_drag_speed"], np.array(p["tail_widths"])
    out, roots = np.zeros(nv), {kind: [0.0] for kind in POINTS}

    def size(u):
        return np.sqrt(u @ u + e * e)

    def push(k, j, across, along_axis, weight):
        columns = np.array([(np.imag(one[k][j][0]) / STEP) for one in moving])
        u, axis = columns[0] - wind, np.real(still[k][j][1])
        ua = u @ axis
        un = u - ua * axis
        force = across * size(un) * un + along_axis * np.sqrt(ua * ua + e * e) * ua * axis
        return -p["air_density"] / 2 * weight * columns[1:] @ force

    for k, (_, kind, length) in enumerate(pieces_of(model)):
        normal, axial = p["tail_drag"]
        for j, (s, w) in enumerate(zip(shares[kind], rules[kind][1] / 2, strict=True)):
            width = (1 - s) * widths[k] + s * widths[k + 1]
            own = axial if kind == "continuum" else 0.0
            out += push(k, j, normal, own, length * w * width)
    still = places(model, q, roots)
    moving = [places(model, q + 1j * STEP * along(q, d), roots) for d in (v, *np.eye(nv))]
    for k, (_, kind, length) in enumerate(pieces_of(model)):
        if kind == "articulated":  # its velocity along itself is the same everywhere
            out += push(k, 0, 0.0, axial, length * (widths[k] + widths[k + 1]) / 2)
    if nv > model.layout.nt:
        R, half = attitude(q[3:7]), p["air_density"] / 2
        u, w = R.T @ (v[:3] - wind), v[3:6]
        out[:3] -= half * R @ (np.array(p["torso_drag"]) * size(u) * u)
        out[3:6] -= half * np.array(p["torso_drag_turning"]) * size(w) * w
        out[3:6] -= np.array(p["torso_air_damping"]) * w
    return out

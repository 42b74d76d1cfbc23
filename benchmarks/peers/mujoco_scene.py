"""Times MuJoCo on an articulated model that stands on the ground.

The physics differs: contacts are MuJoCo's soft constraints with an elliptic cone, and joints that
share an angle are tied by soft equalities. So only the run time of a similar scene can be compared.
"""

import time

import numpy as np

POINT = 5e-4  # m, radius of the spheres that touch the plane


def mjcf(model, feet: np.ndarray, damping: float) -> str:
    """Return MJCF of torso, foot points (n, 3) (m, torso frame), and a tail whose joints share
    segments' angles.
    """
    p, count = model.parameters, model.segments * model.links
    length, mass = p["tail_length"] / count, p["tail_mass"] / count
    spheres = "".join(
        f'<geom type="sphere" size="{POINT}" pos="{_text(x)}" mass="0"/>' for x in feet
    )
    tail = ""
    for k in reversed(range(count)):
        place = p["tail_mount"] if k == 0 else (0, -length, 0)
        joints = "".join(
            f'<joint name="{name}{k}" axis="{axis}" damping="{damping / model.links}"/>'
            for name, axis in (("a", "1 0 0"), ("b", "0 0 1"))
        )
        inertia = (
            f'<inertial pos="0 {-length / 2} 0" mass="{mass}" '
            f'diaginertia="{_text(p["link_inertia"])}"/>'
        )
        tip = f'<geom type="sphere" size="{POINT}" pos="0 {-length} 0" mass="0"/>'
        tail = f'<body pos="{_text(place)}">{joints}{inertia}{tip}{tail}</body>'
    ties = "".join(
        f'<joint joint1="{name}{k}" joint2="{name}{k - k % model.links}"/>'
        for k in range(count)
        if k % model.links
        for name in "ab"
    )
    torso = (
        f'<inertial pos="0 0 0" mass="{p["torso_mass"]}" '
        f'diaginertia="{_text(p["torso_inertia"])}"/>'
    )
    option = f'<option gravity="0 0 {-p["gravity"]}" integrator="implicitfast" cone="elliptic"/>'
    defaults = f'<default><geom friction="{p["mu"]} 0 0" contype="0" conaffinity="1"/></default>'
    ground = '<geom type="plane" size="9 9 1" contype="1" conaffinity="0"/>'
    body = f"<body><freejoint/>{torso}{spheres}{tail}</body>"
    world = f"<worldbody>{ground}{body}</worldbody><equality>{ties}</equality>"
    return f"<mujoco>{option}{defaults}{world}</mujoco>"


def milliseconds(text: str, q, v, span: float, step: float) -> float:
    """Return the least processor time (ms) of a run of `span` s at steps of `step` s, out of
    three.
    """
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = step
    times = []
    for _ in range(3):
        data = mujoco.MjData(model)
        links = (model.nv - 6) // (len(v) - 6)
        data.qpos[:7], data.qvel[:6] = q[:7], v[:6]
        data.qpos[7:] = np.repeat(np.reshape(q[7:], (-1, 2)), links, axis=0).ravel()
        begun = time.process_time()
        for _ in range(round(span / step)):
            mujoco.mj_step(model, data)
        times.append(time.process_time() - begun)
    if not np.isfinite(data.qpos).all():
        raise RuntimeError(f"MuJoCo's run at {step} s is not finite")
    return 1e3 * min(times)


def _text(numbers) -> str:
    return " ".join(map(repr, map(float, numbers)))

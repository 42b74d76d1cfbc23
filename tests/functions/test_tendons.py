"""Lengths of tendons and the torques of tensions: against MuJoCo, a formula, and runs."""

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.problems import SceneError
from serpentail_scene.tendons import names_of_tendons
from tests.support import zoo
from tests.support.rows import row


def spatial(model, q):
    """Lengths and derivatives by MuJoCo's spatial tendons, along a chain of hinges."""
    mujoco = pytest.importorskip("mujoco")
    p, tables = model.parameters, model.manifest["scene"]["tendon"]
    joints, m = model.joints_each, model.segments
    links = np.array(p.get("link_lengths", [p["tail_length"] / joints.sum()] * joints.sum()))
    ends = [t.get("to", m) for t in tables.values() for _ in range(t.get("count", 1))]
    counts = [joints[:to].sum() for to in ends]
    offsets, guides = np.reshape(p["tendon_offsets"], (-1, 2)), np.array(p["tendon_guides"])
    last = np.reshape(p.get("tendon_ends", offsets), (-1, 2))
    roots = p.get("tendon_roots", (1 - guides) * links[0])

    def sites(g):
        along = [offsets[k] + (last[k] - offsets[k]) * g / n for k, n in enumerate(counts)]
        back = roots if g == 0 else -guides * links[g - 1]
        rows = [(k, x, back[k], z) for k, (x, z) in enumerate(along) if g <= counts[k]]
        return "".join(f'<site name="s{k}_{g}" pos="{x!r} {y!r} {z!r}"/>' for k, x, y, z in rows)

    body = sites(0)
    for g, length in enumerate([0.0, *links[:-1]]):
        body += f'<body pos="0 {-length!r} 0"><joint axis="1 0 0"/><joint axis="0 0 1"/>'
        body += '<geom size="1e-3"/>' + sites(g + 1)
    paths = ("".join(f'<site site="s{k}_{g}"/>' for g in range(n + 1)) for k, n in enumerate(counts))
    pulled = "".join(f"<spatial>{path}</spatial>" for path in paths)
    text = f"<mujoco><compiler angle='radian'/><worldbody>{body}{'</body>' * len(links)}"
    text += f"</worldbody><tendon>{pulled}</tendon></mujoco>"
    text = text.replace("np.float64(", "").replace(')"', '"').replace(") ", " ")
    chain = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(chain)
    data.qpos[:] = np.repeat(q[model.layout.tail_q].reshape(m, 2), joints, axis=0).ravel()
    mujoco.mj_forward(chain, data)
    dense = np.zeros((len(counts), chain.nv))
    for k in range(len(counts)):
        for e in range(chain.ten_J_rownnz[k] if hasattr(chain, "ten_J_rownnz") else chain.nv):
            dense[k, e] = np.ravel(data.ten_J)[k * chain.nv + e]
    each = np.repeat(np.arange(m), joints)
    B = np.array([[dense[:, w::2][:, each == i].sum(axis=1) for w in (0, 1)] for i in range(m)])
    return data.ten_length.copy(), B.reshape(2 * m, -1).T

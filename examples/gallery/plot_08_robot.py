"""
A robot levels itself by a swing of its tail
============================================

A small robot falls nose down, as after driving off a ledge. A motor swings its
tail. The tail is light but long, so the swing turns the body. The size is that of
Tailbot (Libby et al., Nature 481, 2012).

The example scene ``tailed_robot`` tracks a swing of 137 degrees. For comparison, we
hold the tail straight.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

robot = st.scenario("tailed_robot")
straight = {"reference.bends": [[0.0], [0.0]]}
swing, held = robot.simulate(), st.scenario("tailed_robot", changes=straight).simulate()
mass = {name: 1e3 * robot.model.parameters[f"{name}_mass"] for name in ("torso", "tail")}
print("torso {torso:.0f} g, tail {tail:.0f} g".format(**mass))

# %%
# Both robots start with the same angular momentum. The swing of the tail takes more
# than all of it, so the torso turns back.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
for motion, name, line in [(swing, "tail swings", "-"), (held, "tail held straight", "--")]:
    pitch = np.degrees(st.pitch_roll_yaw(motion.q, unwrap=True)[:, 0])
    left.plot(1e3 * motion.t, pitch, line, label=name)
    right.plot(1e3 * motion.t, np.degrees(motion.tail[:, 0]), line)
left.axhline(0, color="0.6", linewidth=0.8)
left.set(title="The swing levels the torso", xlabel="time (ms)", ylabel="pitch of the torso (deg)")
right.set(title="The tail", xlabel="time (ms)", ylabel="angle of the tail (deg)")
left.legend(loc="lower left")
plt.show()

# %%
# Both robots over each other:

st.view([swing, held], None, names=["tail swings", "tail held straight"], live=True)

"""
An elastic tail swings from its stops
=====================================

Real tails are elastic, lose energy, and cannot bend without limit. The example
scene ``elastic_tail`` has springs, damping and stops as parameters of the tail
itself. No controller acts: the animal is thrown up with its tail bent against the
stops, and lets go.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

scene = st.scenario("elastic_tail")
motion = scene.simulate()
limp = st.scenario("elastic_tail", changes={"tail_stiffness": 0.0}).simulate()
parameters = scene.model.parameters

# %%
# With springs the tail oscillates about its resting shape. Without springs the same
# damping acts, but nothing brings the tail back. The plot shows the first segment.

plt.style.use("seaborn-v0_8-colorblind")
figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 4.8), sharex=True, layout="constrained")
colour = {"color": "0.5", "linewidth": 1}
top.plot(motion.t, np.degrees(motion.tail[:, 0]), label="elastic tail")
top.plot(limp.t, np.degrees(limp.tail[:, 0]), "--", label="without springs")
for name, angle in [("stop", parameters["tail_stop_upper"]), ("rest", parameters["tail_rest"])]:
    top.axhline(np.degrees(angle[0]), **colour)
    top.text(0.6, np.degrees(angle[0]) + 1, name, ha="right", color="0.4")
top.set(title="Springs bring the tail back", ylabel="bend (deg)")
top.legend()
bottom.plot(motion.t, 1e3 * (motion.energy - motion.energy[0]))
bottom.plot(limp.t, 1e3 * (limp.energy - limp.energy[0]), "--")
bottom.set(xlabel="time (s)", ylabel="change of energy (mJ)")
plt.show()

# %%
# Do the numbers balance? What the damping took away must be what the energy lost.
# The energy includes what springs and stops store.

work = scene.summary(motion)["work_J"]["damping"]
print(f"damping {1e3 * work:.4f} mJ, energy {1e3 * np.ptp(motion.energy[[0, -1]]):.4f} mJ")

# %%
# The elastic tail and the tail without springs, over each other:

st.view([motion, limp], None, names=["elastic tail", "without springs"], live=True)

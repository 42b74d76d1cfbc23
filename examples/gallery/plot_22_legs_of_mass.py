"""
A jump by legs that have mass
=============================

The legs of the paper's rat have no mass: they start at full speed, and the ground
pushes with hundreds of body weights for a moment. In the example scene ``rat_kick``
hips, knees and ankles are hinges with bodies. A schedule of torques stretches them,
with at most half of the peak moments that a jerboa has when it jumps.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

rat = st.scenario("rat_kick")
motion = rat.simulate()
weight = rat.summary(motion)["body_weight_N"]
legs = [group for group in rat.model.contacts if group.startswith("hind")]
force = sum(motion.contact.of(group).forces[..., 2].sum(axis=1) for group in legs) / weight
print(f"the ground pushes both legs with up to {force.max():.1f} body weights")

# %%
# The push lasts 30 ms. All joints stretch together; stops end their motion.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
shown = (motion.t > 0.09) & (motion.t < 0.18)
left.plot(1e3 * motion.t[shown], force[shown], color="C1")
left.set(title="The push", xlabel="time (ms)", ylabel="vertical ground force (body weights)")
for joint in ("hip", "knee", "ankle"):
    angle = np.degrees(motion[f"hind_right_{joint}"])
    right.plot(1e3 * motion.t[shown], angle[shown], label=joint)
right.set(title="The joints", xlabel="time (ms)", ylabel="angle (deg)")
right.legend()
plt.show()

# %%
# The page shows the whole jump, with the forces of the ground as arrows.

motion.view(None)

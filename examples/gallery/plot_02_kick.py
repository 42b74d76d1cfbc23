"""
A kick: feet push off the ground
================================

A crouched kangaroo rat stretches its legs and leaves the ground. The example
scene ``kick`` contains the animal, its start, and the motion of its legs. The
simulation finds when each foot touches the ground and how large the forces are.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

kick = st.scenario("kick")
motion = kick.simulate(output_step=2e-3)  # s
numbers = kick.summary(motion)
for name in ("take_off_s", "apex_m", "recontact_s", "body_weight_N"):
    print(f"{name:<20} {numbers[name]:.3f}")

# %%
# The left plot shows the whole jump. The right plot shows the push-off, simulated
# again with more samples: the force that the ground applies to both feet together.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
left.plot(motion.t, motion.q[:, 2])
left.axhline(0, color="0.5", linewidth=0.8)
for name, word in [("take_off_s", "take-off"), ("recontact_s", "landing")]:
    time = numbers[name]
    height = np.interp(time, motion.t, motion.q[:, 2])
    left.plot(time, height, "o", color="C1")
    left.annotate(f"{word}\n{time:.3f} s", (time, height), (-8, 8), ha="right",
                  textcoords="offset points")  # fmt: skip
left.set(title=f"It jumps {numbers['apex_m']:.2f} m high", xlabel="time (s)")
left.set_ylabel("height of the torso (m)")

push = kick.simulate(t_span=0.405, output_step=2e-5)  # s
force = push.contact.forces[:, :, 2].sum(axis=1) / numbers["body_weight_N"]
late = push.t > 0.399
right.plot(1e3 * push.t[late], force[late], color="C1")
right.set(title="The push lasts milliseconds", xlabel="time (ms)")
right.set_ylabel("vertical ground force (body weights)")
plt.show()

# %%
# The tail is passive here, and nothing stops the tumbling in the air. The page
# shows the forces of the ground as arrows. Its warnings are part of the result: for
# example, the tail passes through the ground, because only the feet of this scene
# have contact. Give the ground less friction, or the tail more mass, and it jumps again.

motion.view(None, live=True)

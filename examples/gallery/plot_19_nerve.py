"""
How good must the nerve be?
===========================

A startled kangaroo rat reacts after 70 ms, the fastest after 38 ms. Here a rat
falls for 0.2 s, 20 cm, with a random pitch and spin. Its nerve tells pitch and rate
late and with noise; the tail is swung by 3 J (w^2 pitch + 1.4 w rate), at most 20 mN m,
where w is how quick the reflex is. A landing is good within 20 degrees of level and
below 3 rad/s. Each of 17 delays, 11 levels of noise and 6 reflexes has 100 flights,
112,200 in all. ``model.step`` makes them side by side.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

stops = {"tail_stop_lower": [-1, -1], "tail_stop_upper": [1, 1], "tail_stop_stiffness": [0.1, 0.1]}
rat = st.build("righting_m1_n3", **stops, tail_damping=[1e-4, 1e-4])
TICK, TICKS, J, MOST = 5e-3, 40, 1e-4, 0.02  # s, ticks until the ground, kg m^2, N m
delays, noises, reflexes = np.arange(0, 165, 10), np.arange(0, 21, 2), [3, 5, 8, 12, 18, 25]
cases = np.meshgrid(delays, noises, reflexes, range(100), indexing="ij")
late, noise, w = cases[0].ravel() * 1e-3, np.radians(cases[1].ravel()), cases[2].ravel()


def torque(pitch, rate, w):
    """The reflex (N m): torques of pitch and yaw of the tail."""
    pull = 3 * J * (w**2 * pitch + 1.4 * w * rate)
    return np.stack([np.clip(pull, -MOST, MOST), 0 * pull], axis=-1)


def pitch_of(q):
    """Pitch (rad) of a torso that only pitches."""
    return 2 * np.arctan2(q[..., 4], q[..., 3])


# %%
# All flights go on by one tick, then all nerves measure. What a nerve told arrives
# after its delay; until then the tail hangs.

random, each = np.random.default_rng(0), np.arange(len(w))
q, v = np.zeros((len(w), rat.nq)), np.zeros((len(w), rat.nv))
half = random.normal(0, np.radians(15), len(w)) / 2
q[:, 3], q[:, 4], v[:, 3] = np.cos(half), np.sin(half), random.normal(0, 1.5, len(w))
told = np.zeros((TICKS, 2, len(w)))  # pitch (rad) and rate (rad/s)
for k in range(TICKS):
    told[k] = [pitch_of(q), v[:, 3]] + noise * random.normal(size=(2, len(w))) * [[1], [20]]
    past = k - np.rint(late / TICK).astype(int)
    tau = torque(*told[np.maximum(past, 0), :, each].T, w) * (past >= 0)[:, None]
    q, v = rat.step(q, v, tau, TICK)

good = (np.abs(pitch_of(q)) < np.radians(20)) & (np.abs(v[:, 3]) < 3)
share = 100 * good.reshape(cases[0].shape).mean(axis=3)  # %, of delay, noise, reflex

# %%
# A quick reflex needs a fast nerve: from 40 ms on it overshoots. If each nerve has the
# reflex that suits it, 70 ms cost little as long as the noise is small.

figure, axes = plt.subplots(1, 2, figsize=(7.5, 3.4), sharey=True, layout="constrained")
for ax, part, title in zip(
    axes, (share[..., 3], share.max(axis=2)), ("w = 12 rad/s", "the w that suits"), strict=True
):
    filled = ax.contourf(delays, noises, part.T, levels=range(0, 101, 10), cmap="viridis")
    ax.vlines([38, 70], 0, 20, "w", "dashed")
    ax.set(title=title, xlabel="delay (ms)")
axes[0].set_ylabel("noise of pitch (deg)")
figure.colorbar(filled, ax=axes, label="good landings (%)")
plt.show()

# %%
# One flight with 70 ms and w = 12 rad/s, by ``st.simulate`` and ``st.Sampled``.

nerve = st.Sampled(lambda t, q, v: torque(pitch_of(q), v[3], 12), rate=1 / TICK, delay=0.07)
start = rat.state(height="20 cm", pitch="15 deg", spin=[1.5, 0, 0])
st.simulate(rat, start, 0.2, controller=nerve)

"""
The least period of a gait
==========================

How fast can servos run Gait 3? Its corners are rounded. The time-optimal law, the fastest one, is at one of the limits
all the time.
"""

import matplotlib.pyplot as plt
import numpy as np

import gaitgraph as gg

gait = gg.lift(
    [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red"
)
limits = gg.Limits(rate="300deg", acceleration=60.0)

# %%
# Without rounding the law rests at every corner. Two degrees of rounding save a fifth of the time.

resting = gg.least_period(gait, limits)
pacing = gg.least_period(gait, limits, rounding="2deg")
print(f"least period: {resting.least:.3f} s with rests, {pacing.least:.3f} s rounded")
print(pacing)

# %%
# A period that is too short is refused, with the limit that it would break.

print(gg.paced(gait, limits, period=0.6, rounding="2deg").reason)

# %%
# Servos with a lag of 20 ms cut the corners a little more, and stay on the sheet.

timed = pacing.timed
assert timed is not None
print(gg.timing.servo_response(timed, 0.02))

# %%
# The limits, and where the law reaches them.

t = np.linspace(0, timed.period, 2001)
figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
loop = timed.at(t).alpha
speed = np.linalg.norm(timed.at(t).rates[:, :2], axis=1)
points = axes[0].scatter(loop[:, 0], loop[:, 1], c=speed, s=6)
figure.colorbar(points, ax=axes[0], label="speed in the plane [rad/s]")
axes[0].set(xlabel="α1 [rad]", ylabel="α2 [rad]", aspect="equal")
for ax, order, name, limit in (
    (axes[1], 1, "rate [rad/s]", limits.rate),
    (axes[2], 2, "acceleration [rad/s²]", limits.acceleration),
):
    for joint in range(2):
        ax.plot(t, timed.derivative(t, order)[:, joint], label=f"α{joint + 1}")
    assert limit is not None
    for sign in (-1, 1):
        ax.axhline(sign * limit[0], color="black", linestyle="dotted")
    ax.set(xlabel="t [s]", ylabel=name)
    ax.legend()

"""
Retarget a gait
===============

A motion of four angles that is copied from an animal is on none of the surfaces. Which flyable gait is nearest to it,
and by how much does it differ?
"""

import numpy as np

import gaitgraph as gg
from gaitgraph import plots

# %%
# Four legs that swing one after another, as in a walk: opposite arms are half a period apart.

t = np.linspace(0.0, 2.0, 41)
swing = [
    0.4 * np.sin(np.pi * t - phase) for phase in (0.0, np.pi / 2, np.pi, 3 * np.pi / 2)
]
middle = (-0.3, 0.5, -0.1, 0.1)
columns = {f"alpha{k + 1}": middle[k] + swing[k] for k in range(4)}
walk = gg.Table(columns={"t": t, **columns})
print(gg.validate(walk).valid)

# %%
# Opposite arms must move together on the red sheet, so only the mean motion of opposite legs remains: of a walk
# a point. In a trot opposite legs move together, but for their mean positions, and most of the motion remains.

print(gg.retarget(walk))
trot = gg.Table(
    columns={
        "t": t,
        **{f"alpha{k + 1}": middle[k] + 1.5 * swing[k % 2] for k in range(4)},
    }
)
answer = gg.retarget(trot)
print(answer)

# %%
# Keeping 0.1 rad from the border of the flyable region, where a pair of rotors would idle, moves it a little more.

careful = gg.retarget(trot, margin=0.1)
print(
    f"{answer.rms:.4f} rad rms at the border, {careful.rms:.4f} rad rms 0.1 rad inside"
)

# %%
# Before and after, in the plane: the first two angles of the given table, its projection onto the red sheet, the gait.

assert answer.table is not None
assert careful.table is not None
ax = plots.singular_value_map()
alpha = trot.alpha
ax.plot(*alpha[:, :2].T, linestyle=":", color="black", label="given (α1, α2)")
ax.plot(
    *(alpha[:, :2] + alpha[:, 2:]).T / 2,
    linestyle="--",
    color="black",
    label="projected",
)
ax.plot(*answer.table.alpha[:, :2].T, color="white", linewidth=2, label="retargeted")
ax.plot(
    *careful.table.alpha[:, :2].T, color="white", linewidth=0.8, label="0.1 rad inside"
)
ax.legend(loc="lower left", fontsize="small", facecolor="0.6")

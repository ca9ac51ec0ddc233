"""
A gait on a fibre
=================

The red sheet is not all there is: on a fibre one pair of opposite arms stands still, and the arms of the other pair
tilt independently. This loop starts on the red sheet, where opposite arms tilt alike, goes onto the first fibre, where
arms 2 and 4 do not, and comes back.
"""

import matplotlib.pyplot as plt
import numpy as np

import gaitgraph as gg
from gaitgraph.surface.sheets import family_distances

# %%
# Waypoints have two angles, for the red sheet, or four. Angles near a fibre are moved onto it. The loop is valid, and
# not flyable: two rotors idle on the fibre.

waypoints = [(-0.9, -0.1), (0.167, -0.2, 0.167, 0.9), (0.167, 1.2, 0.167, 0.3), (-0.6, 1.1)]
plan = gg.plan_loop(waypoints, sheets="all")
print(*(note for note in plan.warnings if "moved" in note), sep="\n")
print(f"valid {plan.report.valid}, flyable {plan.report.flyable}: {plan.reason}")

# %%
# Each leg is straight once the two pages are unfolded into one plane. On the paper's grid the way is longer. Travel is
# the length in all four angles, over √2: in the (α1, α2) plane a way on the first fibre looks shorter than it is.

exact, on_grid = plan.gait, gg.plan_loop(waypoints, sheets="all", method="grid").gait
coefficients = exact.coefficients
print(f"travel {on_grid.travel:.4f} rad on the grid, {exact.travel:.4f} rad straight; valid {exact.check().valid}")

# %%
# The two pages side by side. They share the line, drawn black: α1 = δ on the red sheet, α2 = α4 on the fibre.

angle = np.linspace(-np.pi / 2, np.pi / 2, 361)
x, y = np.meshgrid(angle, angle)
delta = np.full_like(x, coefficients.delta)
figure, (sheet, fiber) = plt.subplots(1, 2, figsize=(9, 4.5), layout="constrained")
for ax, page, shown in ((sheet, (x, y, x, y), (0, 1)), (fiber, (delta, x, delta, y), (1, 3))):
    positive = gg.invertibility.level_determinant(np.stack(page, axis=-1), coefficients) > 0
    ax.contourf(x, y, positive, levels=[-0.5, 0.5, 1.5], colors=["0.85", "white"])
    for gait, style in ((on_grid, ":"), (exact, "-")):
        for start, end in zip(gait.alpha, gait.ends, strict=True):
            on_page = family_distances([start, end], coefficients)[:, 0 if ax is sheet else 2].max() < 1e-9
            if on_page:
                ax.plot(*np.array([start, end])[:, shown].T, style, color="#e0301e" if ax is sheet else "#7a3b9c")
    ax.set(xlabel=rf"$\alpha_{shown[0] + 1}$ (rad)", ylabel=rf"$\alpha_{shown[1] + 1}$ (rad)", aspect="equal")
sheet.plot(delta[0], angle, color="black", linewidth=0.8)
fiber.plot(angle, angle, color="black", linewidth=0.8)
sheet.set_title("the red sheet; R < 0 is grey, the grid's loop dotted")
fiber.set_title("the first fibre")

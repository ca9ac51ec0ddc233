"""
Which drag ratio
================

Rotors and arms enter the gait surfaces by one number, the drag ratio κ = Km/(Kf·L). How much of the plane of tilt
angles is flyable for which κ, how much of that is reachable from hover, and how far is hover from its border?
"""

import math

import matplotlib.pyplot as plt
import numpy as np
import shapely

import gaitgraph as gg
from gaitgraph import plots

# %%
# Where the least singular value is at least 0.05 and all hover thrusts are positive, by sign of R, in rad². The
# part reached from hover is one component of R > 0. Margin is the distance from α = 0 to its border; light is the part
# of it where no rotor hovers with more than 0.4 of the weight.

kappas = (0.02, 0.0249, 0.0251, 0.05, 0.1, gg.PAPER.drag_ratio, 0.35, 0.7, 1.0, 1.5)
areas, margins, maps = [], [], {}
print("     κ  δ = atan κ  R > 0  R < 0  reached margin  light")
for kappa in kappas:
    vehicle = gg.Vehicle(name=f"κ = {kappa:g}", drag_ratio=kappa)
    positive = gg.admissible_region(vehicle, sign="positive", accuracy=1e-4)
    negative = gg.admissible_region(vehicle, sign="negative", accuracy=1e-4)
    number = positive.component_of((0.0, 0.0))
    reached = shapely.Polygon() if number is None else positive.components[number]
    margin = 0.0 if number is None else reached.boundary.distance(shapely.Point(0, 0))
    light = reached.intersection(
        gg.surface.thrust_region(0.4, vehicle, accuracy=1e-4).inner
    ).area
    areas.append((positive.area, negative.area, reached.area))
    margins.append(margin)
    maps[kappa] = (positive.components, negative.components, (reached,))
    row = f"{positive.area:7.3f}{negative.area:7.3f}{reached.area:9.3f}{margin:7.3f}{light:7.3f}"
    print(f"{kappa:6.4f}{math.degrees(math.atan(kappa)):10.2f}°{row}")

# %%
# The area that hover reaches hardly depends on κ: without a floor it is (π/2)² for every vehicle. κ moves hover
# itself away from the corner (δ, −δ) where the matrix is singular. At α = 0 the least singular value is 2κ, and √2 at
# most, so that nothing is reached where κ < 0.025.

for kappa in (0.0249, 0.0251):
    value = gg.invertibility.least_singular_value(
        [0, 0, 0, 0], gg.Vehicle(drag_ratio=kappa)
    )
    print(f"κ = {kappa}: least singular value {value:.4f} at α = 0")

# %%
# The regions for three vehicles; the cross is hover. Both signs of R have the same area, to the third digit.

colors = {"R > 0": "#f0c020", "R < 0": "#a9a9bd", "reached from hover": "#e0762e"}
figure, axes = plt.subplots(
    1, 4, figsize=(13, 3.6), layout="constrained", width_ratios=(1.2, 1, 1, 1)
)
for ax, kappa in zip(axes[1:], (0.05, gg.PAPER.drag_ratio, 1.0), strict=True):
    for shapes, color in zip(maps[kappa], colors.values(), strict=True):
        for shape in shapes:
            ax.fill(*np.transpose(shape.exterior.coords), color=color, linewidth=0)
    ax.plot(0, 0, "k+", markersize=8)
    plots.plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    ax.set_title(f"κ = {kappa:.3g}")
for (name, color), area in zip(colors.items(), np.transpose(areas), strict=True):
    axes[0].semilogx(
        kappas,
        area,
        "--" if name == "R < 0" else "-",
        color=color,
        label=f"{name} [rad²]",
    )
axes[0].semilogx(kappas, margins, "k:", label="margin around α = 0 [rad]")
ticks = (0.02, 0.05, 0.1, 0.2, 0.5, 1)
axes[0].set(
    xlabel="κ",
    ylim=(0, None),
    xticks=ticks,
    xticklabels=[f"{tick:g}" for tick in ticks],
)
axes[0].minorticks_off()
axes[0].legend(fontsize="small", loc="center left", bbox_to_anchor=(0.02, 0.45))

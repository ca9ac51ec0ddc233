"""
The four gaits of the paper
===========================

All four are valid by the paper's rules. Two of them are blue, and in exact physics the blue sheet is singular: they
cannot fly. Of the other two one can be entered from ordinary hover.
"""

from math import pi

import gaitgraph as gg
from gaitgraph import plots

square = [
    (3 * pi / 8, -3 * pi / 8),
    (3 * pi / 8, -pi / 8),
    (pi / 8, -pi / 8),
    (pi / 8, -3 * pi / 8),
]
first = [
    (5 * pi / 16, pi / 8),
    (5 * pi / 16, 3 * pi / 8),
    (pi / 16, 3 * pi / 8),
    (pi / 16, pi / 8),
]
fourth = [
    (-pi / 8, pi / 8),
    (-pi / 8, 3 * pi / 8),
    (-3 * pi / 8, 3 * pi / 8),
    (-3 * pi / 8, pi / 8),
]
gaits = {
    "Gait 1": gg.lift(first, "blue"),
    "Gait 2": gg.lift(square, "blue"),
    "Gait 3": gg.lift(square, "red"),
    "Gait 4": gg.lift(fourth, "red"),
}

# %%
# To lift a loop is to take (α3, α4) from the sheet of its color. Gaits 2 and 3 are one loop on two sheets.

for name, gait in gaits.items():
    print(name, gait.color, "from", gait.alpha[0].round(3), "with R =", gait.R.round(4))

ax = plots.regions_map()
for gait in gaits.values():
    plots.gait_loop(gait, ax=ax)

# %%
# The verdicts. A gait that is not flyable has a reason.

for name, gait in gaits.items():
    report = gg.validate(gait)
    print(
        f"{name}: valid {report.valid}, flyable {report.flyable}, from hover {report.reachable_from_hover}"
    )
    print(f"        {report.reason or 'nothing against it'}")

# %%
# Gaits 1 and 2 have a sign of R only because the paper's coefficients have four digits: on the blue sheet R is below
# their rounding. The sign is undecided, ``??``; with exact coefficients R is zero.

sign = gg.validate(gaits["Gait 2"])["R_sign"]
print(sign.mark, f"R nearest to 0 is {sign.value:.1e}; its error {sign.limit:.1e}")
exact = gg.lift(
    square, "blue", coefficients=gg.invertibility.coefficients_of(kind="exact")
)
print("with exact coefficients: valid", gg.validate(exact).valid)

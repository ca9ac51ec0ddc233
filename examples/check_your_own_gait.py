"""
Check a gait of your own
========================

Color the corners of a loop, or state all four angles, and check every rule.
"""

import gaitgraph as gg
from gaitgraph import plots

# %%
# A loop with a color for each corner. Figure 15 of the paper states which types may be neighbours.

loop = [(0.9, -0.9), (1.1, -0.9), (1.1, -0.5)]
mixed = gg.lift(loop, ["red", "blue", "blue"])
report = gg.validate(mixed)
print(report["two_color"].message)

# %%
# A report is falsy when the gait is not valid, and is indexed by the name of a check.

for check in report.checks:
    print(f"{check.mark}  {check.name:22}{check.value}")

# %%
# Equations (12) to (15) of the paper scale α3 and α4 by η. Such a gait leaves the surfaces. The report states where
# and by how much. Its tilt margin is no longer 90°, even if its matrix is far from singular in level flight.

scaled = gg.lift(loop, "red").biased(0.8)
report = gg.validate(scaled)
print(report)

# %%
# In the plane of α1 and α3 the red sheet is the diagonal. The biased gait is drawn in black, dotted.

ax = plots.gait_loop(gg.lift(loop, "red"), angles=(1, 3))
plots.gait_loop(scaled, angles=(1, 3), ax=ax)

# %%
# The same loop, all red, is like Gait 3: valid and flyable, and not reachable from ordinary hover.

report = gg.validate(gg.lift(loop, "red"))
print(report.valid, report.flyable, report.reachable_from_hover)

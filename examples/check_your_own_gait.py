"""
Check a gait of your own
========================

Paint a loop, or bring all four angles, and ask what holds and what does not.
"""

import gaitgraph as gg
from gaitgraph import plots

# %%
# A loop with a color for each corner. Figure 15 of the paper says which types may stand side by side.

loop = [(0.9, -0.9), (1.1, -0.9), (1.1, -0.5)]
painted = gg.lift(loop, ["red", "blue", "blue"])
report = gg.validate(painted)
print(report["two_color"].message)

# %%
# A report is falsy when the gait is not valid, and is indexed by the name of a check.

for check in report.checks:
    print(f"{check.mark}  {check.name:22}{check.value}")

# %%
# Equations (12) to (15) of the paper scale α3 and α4 by η. A gait biased so leaves the surfaces. The report says where,
# and by how much; it keeps its distance from singular attitudes no longer, however far from singular it is when level.

scaled = gg.lift(loop, "red").biased(0.8)
report = gg.validate(scaled)
print(report)

# %%
# In the plane of α1 and α3 the red sheet is the diagonal. The biased gait is drawn in black, dotted.

ax = plots.gait_loop(gg.lift(loop, "red"), angles=(1, 3))
plots.gait_loop(scaled, angles=(1, 3), ax=ax)

# %%
# The same loop, all red, is what Gait 3 is: valid and flyable, and out of the reach of ordinary hover.

report = gg.validate(gg.lift(loop, "red"))
print(report.valid, report.flyable, report.reachable_from_hover)

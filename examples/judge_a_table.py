"""
Judge a table
=============

One angle of this table is wrong. The report states which one, where, and what would help.
"""

from pathlib import Path

import gaitgraph as gg
from gaitgraph import plots

# %%
# A table needs the columns alpha1 to alpha4; t is used if it is there. The last row may repeat the first.

rows = """t,alpha1,alpha2,alpha3,alpha4
0.00,1.178,-1.178,1.178,-1.178
0.25,1.178,-0.393,1.278,-0.393
0.50,0.393,-0.393,0.393,-0.393
0.75,0.393,-1.178,0.393,-1.178
1.00,1.178,-1.178,1.178,-1.178
"""
Path("broken.csv").write_text(rows)
report = gg.validate("broken.csv")
print(report)

# %%
# Three checks fail for one reason. ``two_color`` names row 2; ``on_surface`` names a place between rows 1 and 2,
# where the gait is farthest off: checks cover the segments too.

print("first reason:", report.reason)
place = report["on_surface"].where
if place:
    print(
        f"row {place['row']}, {place['fraction']:.2f} of the segment to the next, t = {place['t']:.3f} s"
    )

# %%
# The correct values are among the roots above (α1, α2) of row 2.

for root in gg.roots(1.178, -0.393, coefficients=gg.invertibility.coefficients_of()):
    print(
        f"{root.color:5}{root.types}  α3 = {root.alpha3:+.3f}, α4 = {root.alpha4:+.3f}, R = {root.R:+.4f}"
    )

# %%
# With the red one the table is valid, and flyable.

red = gg.roots(1.178, -0.393, coefficients=gg.invertibility.coefficients_of())[0]
Path("corrected.csv").write_text(rows.replace("1.278", f"{red.alpha3:.3f}"))
print("corrected: flyable", gg.validate("corrected.csv").flyable)
plots.gait_loop(gg.gait_of(gg.read_table("corrected.csv")), ax=plots.regions_map())

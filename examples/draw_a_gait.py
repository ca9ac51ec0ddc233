"""
Draw a gait
===========

Every plot takes axes or makes its own, and returns them. It shows the package's own results.
"""

import matplotlib.pyplot as plt

import gaitgraph as gg
from gaitgraph import plots

gait = gg.plan_loop(
    [("-pi/8", "pi/8"), ("-pi/8", "3pi/8"), ("-3pi/8", "3pi/8"), ("-3pi/8", "pi/8")]
).gait

# %%
# How well the matrix can be inverted on the red sheet, with the gait on it. R = 0 on the black curves.

plots.gait_loop(gait, ax=plots.singular_value_map())

# %%
# Its four angles over time.

gait.parametrize(period=1.5).plot()

# %%
# Plots on your own axes, side by side. The second one is the gait's loop among the regions of the red sheet.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.5), layout="constrained")
plots.vehicle_figure(gait.vehicle, ax=left)
plots.gait_loop(gait, ax=plots.regions_map(ax=right))

# %%
# The figures of the paper, and two that it lacks, are written by their names. Without ``force`` a file that exists is
# refused; the same call gives the same bytes.

for path in plots.write_figures(
    "figures", only=["15", "regions"], formats=["svg"], force=True
):
    print(path.name)

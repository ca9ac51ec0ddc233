"""
The basin of a gait
===================

The roll and pitch from which a gait levels out, found by simulating each, for a gait on the red sheet and for the same
gait biased. The paper compares the two by their determinant alone.
"""

import matplotlib.pyplot as plt

import gaitgraph as gg
from gaitgraph import plots

gait = gg.plan_loop(
    [("-pi/8", "pi/8"), ("-pi/8", "3pi/8"), ("-3pi/8", "3pi/8"), ("-3pi/8", "pi/8")]
).gait
timed = gait.parametrize(1.0)

# %%
# Rotors may give four times a quarter of the weight; hovering in this gait takes up to 2.6 times on one rotor.
# Attitudes are *acceptable* where the gait is never singular; *singular once* are the others.

(mass,) = gait.vehicle.require("mass", purpose="a share of the weight")
settings = gg.FlightSettings(thrust_limit=mass * gait.vehicle.gravity)
red, biased = gg.basins_of(
    timed, bias=[1.0, 0.8], settings=settings, resolution=4, extent="70deg"
)
for basin in (red, biased):
    print(basin)

# %%
# A green disc is an attitude from which the flight settled. Thin lines are attitudes that are singular at some time of
# the period; the thick line borders the acceptable ones. All are acceptable for the gait on the sheet, yet it settles
# from no more of them than the biased gait does.

figure, axes = plt.subplots(1, 2, figsize=(8, 6), layout="constrained")
for ax, basin in zip(axes, (red, biased), strict=True):
    plots.basin_map(basin, ax=ax)

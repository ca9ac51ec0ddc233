"""
Fly a gait
==========

A gait in the physics engine MuJoCo, with feedback linearisation of altitude, roll, pitch and yaw by the thrusts alone.
"""

import matplotlib.pyplot as plt
import numpy as np

import gaitgraph as gg
from gaitgraph import plots

corners = np.pi / 8 * np.array([(3, -3), (3, -1), (1, -1), (1, -3)])
red = gg.lift(corners, "red")

# %%
# The vehicle starts with a roll of 0.3 rad and a pitch of −0.2 rad. The flight is truthy when it settled.

flight = gg.fly(red.parametrize(period=1.0))
print(flight)

# %%
# The gait again with α3 and α4 scaled by 0.8: off the surfaces, but physics does not forbid it.

biased = gg.fly(red.biased(0.8).parametrize(period=1.0))
print(
    f"biased by 0.8: {biased.peak_thrust_share:.2f} shares, least singular value {biased.least_singular_value:.3f}"
)

# %%
# The blue sheet through the same corners is Gait 2 of the paper. Its matrix is singular but for rounding, so it is
# refused. Flown all the same, without the floor at which a flight stops, its rotors would need thousands of times
# their share of the weight.

blue = gg.lift(corners, "blue").parametrize(period=1.0)
print(gg.fly(blue).reason)
anyway = gg.fly(blue, anyway=True, settings=gg.FlightSettings(floor=0.0))
print(anyway.reason)

# %%
# Side by side. Thrusts are multiples of a quarter of the weight.

panels = ("attitude", "thrusts", "singular_value")
axes = plt.figure(figsize=(13, 6), layout="constrained").subplots(3, 3)
for column, one, name in zip(
    axes.T, (flight, biased, anyway), ("red", "biased by 0.8", "blue"), strict=True
):
    plots.plot_flight(one, axes=column, panels=panels)[0].set_title(name, pad=26)
    column[1].get_legend().remove()  # wider than a column; curves are rotors 1 to 4

# %%
# Gait 4 has R > 0 as hover has, and can be entered from it; Gait 3 has R < 0, and cannot.

for name, points in (("Gait 3", corners), ("Gait 4", corners[:, ::-1])):
    course = gg.flight.from_hover(gg.lift(points, "red").parametrize(period=1.0))
    print(f"{name}: {course if isinstance(course, str) else gg.fly(course)!r}")

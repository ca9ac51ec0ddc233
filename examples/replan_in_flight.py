"""
Plan again in flight
====================

A keep-out appears while the vehicle flies a circle. The gait changes within a millisecond and without a stop, and the
least singular value never falls below its floor.
"""

import matplotlib.pyplot as plt
import numpy as np
import shapely

import gaitgraph as gg
from gaitgraph import plots
from gaitgraph.flight import Course
from gaitgraph.planning import Replanner

# %%
# All that does not change is prepared once: the region for one sign of R, the floor, the tilt rate.

FLOOR = 0.2
replanner = Replanner("paper", sign="positive", floor=FLOOR, rate=3.0)
waypoints = [(-0.4, 0.3), (-0.4, 1.0), (-1.0, 1.0), (-1.0, 0.3)]
before = replanner.replan([-0.4, 0.3, -0.4, 0.3], waypoints)
print(
    f"at first: {before.period:.3f} s around, least singular value at least {before.least_singular_value:.3f}"
)

# %%
# At 2 s a polygon in the plane of tilt angles is forbidden. The new loop is planned from the present angles. The
# waypoint that comes next is stated first, so the vehicle goes on in its direction.

appears = 2.0
keep_out = [(-0.6, 0.9), (-0.8, 0.9), (-0.75, 1.2), (-0.55, 1.1)]
own = appears % before.period
following = int(np.searchsorted(before.timed.corner_times, own)) % len(waypoints)
ahead = [*waypoints[following:], *waypoints[:following]]
after = replanner.replan(before.at(own).alpha, ahead, keep_out=[keep_out])
print(
    f"then: {after.duration:.3f} s to waypoint {following + 1}, {after.period:.3f} s around,",
    end=" ",
)
print(
    f"least singular value at least {after.least_singular_value:.3f}, {len(after.loop)} corners"
)
assert after
assert after.timed.gait.check(floor=FLOOR).flyable

# %%
# The flight follows the first loop, the approach and the second loop, one after the other, at the speed of the plans.

sections = (
    (0.0, 0.0, before.timed),
    (appears, 0.0, after.entry),
    (appears + after.duration, 0.0, after.timed),
)
course = Course(
    sections=sections, duration=float("inf"), phases=("gait", "entry", "gait")
)
settings = gg.FlightSettings(
    reference="circle", size=0.5, lap=4.0, duration=6.0, floor=FLOOR
)
flight = gg.fly(course, settings=settings)
print(flight)
assert flight.settled
assert flight.least_singular_value is not None
assert flight.least_singular_value >= FLOOR
second = flight.column("t") >= appears
assert not shapely.intersects_xy(
    shapely.Polygon(keep_out).buffer(-1e-4), flight.alpha[second, :2]
).any()
rates = np.abs(np.diff(flight.alpha, axis=0)).max(axis=1) * settings.control_rate
print(
    f"tilt rates at the change: {rates[1950:2050].min():.2f} to {rates[1950:2050].max():.2f} rad/s, no stop"
)

# %%
# The loop before and after over the map of the least singular value, and the circle.

figure = plt.figure(figsize=(11, 4.8), layout="constrained")
plane, place = figure.subplots(1, 2)
plots.singular_value_map(ax=plane)
plane.fill(*np.transpose(keep_out), facecolor="none", edgecolor="white", hatch="///")
for found, style in ((before, "--"), (after, "-")):
    plane.plot(
        *np.vstack([found.approach, found.loop[1:], found.loop[:1]]).T,
        style,
        color="white",
    )
plane.set(xlim=(-np.pi / 2, 0.3), ylim=(-0.3, np.pi / 2))
for part, style, name in ((~second, "--", "first loop"), (second, "-", "second loop")):
    place.plot(
        flight.column("x")[part],
        flight.column("y")[part],
        style,
        color="C0",
        label=name,
    )
place.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
place.legend()

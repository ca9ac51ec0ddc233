"""
A vehicle of your own
=====================

Only the drag ratio κ = Km/(Kf·L) and the spin shape the surfaces; limits decide what the vehicle can fly.
"""

import gaitgraph as gg
from gaitgraph import plots

# %%
# Limits that are not stated are not checked: without ``max_thrust`` there is no check of thrust limits.

mine = gg.Vehicle(
    name="mine",
    mass=1.2,
    arm_length=0.25,
    drag_to_thrust=0.02,  # Km/Kf in metres
    max_tilt=gg.angles.angle_from_text("75deg"),
    max_tilt_rate=5.0,
    max_thrust=9.0,
)
print(
    f"κ = {mine.drag_ratio:.3f}, δ = {gg.invertibility.coefficients_of(mine).delta:.4f} rad"
)

# %%
# The coefficients of formula (1) are those of the vehicle, exact. The paper's four digits belong to its own vehicle.

for vehicle in (gg.PAPER, mine):
    numbers = gg.invertibility.coefficients_of(vehicle, "exact")
    print(
        f"{vehicle.name:6}",
        *(
            f"{value:8.4f}"
            for value in (numbers.attitude, numbers.single, numbers.double)
        ),
    )

# %%
# The first period is too short for its servos: the reason states the period that is long enough.

waypoints = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
for period in (1.0, 2.0):
    plan = gg.plan_loop(waypoints, vehicle=mine, period=period)
    print(f"T = {period} s: {'flyable' if plan else plan.reason}")

# %%
# The regions of its red sheet, with the loop. A smaller κ brings R = 0 nearer to the diagonal and to the sides.

plots.gait_loop(plan.gait, ax=plots.regions_map(mine))

# %%
# All checks, with the limits that the vehicle states.

print(plan.report)

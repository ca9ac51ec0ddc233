"""A vehicle of your own: only the drag ratio shapes the surfaces; limits decide what it can fly."""

import gaitgraph as gg

mine = gg.Vehicle(
    name="mine",
    mass=1.2,
    arm_length=0.25,
    drag_to_thrust=0.02,  # Km/Kf in metres
    max_tilt=gg.angle_from_text("75deg"),
    max_tilt_rate=5.0,
    max_thrust=9.0,
)
print(f"κ = {mine.drag_ratio:.3f}, δ = {gg.coefficients_of(mine).delta:.4f} rad")

waypoints = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
for period in (1.0, 2.0):
    plan = gg.plan_loop(waypoints, vehicle=mine, period=period)
    print(f"T = {period} s: {'flyable' if plan.report.flyable else plan.reason}")

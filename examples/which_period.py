"""
Which period a servo allows
===========================

Servos limit a gait by their rate and acceleration, and by their lag. How short may the period of Gait 3 be, and what
happens in flight if it is too short?
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import gaitgraph as gg

gait = gg.plan_loop(
    [("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
).gait
rate, lag = math.radians(300), 0.05

# %%
# The least period within the limits. The paper's T = 1 s is just possible, unless jerk is limited too.

limits = gg.Limits(rate=rate, acceleration=60.0)
for name, pacing in (
    ("at rest in the corners", gg.least_period(gait, limits)),
    ("corners rounded by 2°", gg.least_period(gait, limits, rounding="2deg")),
    (
        "at rest, and 2000 rad/s³",
        gg.least_period(gait, gg.Limits(rate=rate, acceleration=60.0, jerk=2000.0)),
    ),
):
    print(f"least period {name}: {pacing.least:.3f} s")

# %%
# With a lag of 50 ms and shorter and shorter periods the settled loop shrinks towards its centre. It stays on the
# sheet, since opposite servos have the same error; one servo with a lag of 60 ms takes it off.

for period in (2.0, 1.0, 0.5, 0.25):
    alike = gg.timing.servo_response(gait.parametrize(period), lag)
    unlike = gg.timing.servo_response(
        gait.parametrize(period), [lag, lag, 1.2 * lag, lag]
    )
    print(
        f"T = {period:4g} s: error {alike.peak.max():.3f} rad, off the sheet {alike.distance_off_sheet:.3f} rad, "
        f"with one slower servo {unlike.distance_off_sheet:.3f} rad, "
        f"least singular value {alike.least_singular_value:.3f}"
    )

# %%
# Flown from roll 0.3 and pitch −0.2 rad with that lag and no more than 300°/s. The controller of the simulation is
# given the arms' actual angles, as from servos that report them. With the law smooth T ≤ 1 s needs more than 300°/s and is refused, so it is flown with
# anyway=True, and the servos follow at their limit. All settle; the peak is at once, since the gait begins in its worst
# corner. Shares are quarters of the weight.

settings = gg.FlightSettings(
    duration=3.0, servo_lag=lag, servo_rate=rate, arms="served"
)
quarter = 0.25 * 0.429 * 9.8  # of the weight of the paper's vehicle [N]
flights = {
    period: gg.fly(gait.parametrize(period), settings=settings, anyway=True)
    for period in (2.0, 1.0, 0.5, 0.25)
}
for period, flight in flights.items():
    later = flight.column("t") >= 1.0
    span = np.ptp(flight.column("alpha1")[later])
    print(
        f"T = {period:4g} s: settles after {flight.settling_time:.2f} s, peak {flight.peak_thrust_share:.2f} shares, "
        f"{flight.thrusts[later].max() / quarter:.2f} after 1 s, where α1 spans {span:.2f} rad"
    )

# %%
# The loops that are flown after the first second, and the largest thrust.

figure, (left, right) = plt.subplots(
    1, 2, figsize=(9, 3.8), layout="constrained", width_ratios=(1, 1.6)
)
left.plot(*np.vstack([gait.alpha, gait.alpha[:1]])[:, :2].T, "k:", label="planned")
for period, flight in flights.items():
    later = flight.column("t") >= 1.0
    left.plot(
        flight.column("alpha1")[later],
        flight.column("alpha2")[later],
        label=f"T = {period:g} s",
    )
    right.plot(flight.column("t"), flight.thrusts.max(axis=1) / quarter)
left.set(xlabel="α1 [rad]", ylabel="α2 [rad]", aspect="equal")
right.set(
    xlabel="t [s]", ylabel="largest thrust [quarter of the weight]", ylim=(0, None)
)
left.legend(fontsize="small", loc="center")

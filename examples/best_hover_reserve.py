"""
The best hover reserve
======================

Tilted rotors waste thrust, and the most loaded rotor limits the gait. How much thrust does Gait 4 need, which loop near
its waypoints needs least, and where would a square of its size need least? The results are simulated.
"""

import math
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt

import gaitgraph as gg
from gaitgraph import plots

still = gg.FlightSettings(
    duration=1.0, servo_lag=0.0
)  # the arms follow the gait exactly


def square(center: float, side: float = math.pi / 4) -> npt.NDArray[np.float64]:
    """Return the corners of a square around (−center, center)."""
    near, far = center - side / 2, center + side / 2
    return np.array([(-near, near), (-near, far), (-far, far), (-far, near)])


def largest(corners: npt.NDArray[np.float64], vehicle: gg.Vehicle) -> float:
    """Return the largest hover thrust along a loop, in quarters of the weight; infinite where a rotor would idle."""
    points = np.vstack(
        [np.linspace(a, b, 41) for a, b in pairwise([*corners, corners[0]])]
    )
    shares = gg.invertibility.hover_thrust_shares(points[:, [0, 1, 0, 1]], vehicle)
    return 4 * float(shares.max()) if shares.min() > 0 else math.inf


# %%
# Two vehicles whose rotors can push 2.4 quarters of the weight. The rotors of beetle_omni spin the other way round, so
# its surfaces are mirrored in the origin and the waypoints with them. Gait 4 needs 1/cos(3π/8) = 2.61 quarters at its
# outermost corner, whatever the vehicle, and is refused. Through discs of 0.2 rad around the waypoints there is a loop
# that needs 1.9644, and none that needs less than 1.9643.

flown = {}
for name, mirror in (("paper", 1), ("beetle_omni", -1)):
    strong = gg.vehicle_named(name)
    mass, gravity = strong.require("mass", "gravity", purpose="a quarter of the weight")
    vehicle = strong.replace(max_thrust=2.4 * mass * gravity / 4)
    corners = mirror * square(math.pi / 4)
    print(
        f"{name}: {gg.fly(gg.lift(corners, 'red', vehicle=vehicle).parametrize(1.0), settings=still).reason}"
    )
    best = gg.optimal_gait(
        corners, radius=0.2, objective="hover_reserve", vehicle=vehicle, pieces=24
    )
    assert best.value is not None
    assert best.bound is not None
    needed, bound = 2.4 - 4 * best.value, 2.4 - 4 * best.bound
    print(f"  best within 0.2 rad: {needed:.4f} quarters, any loop needs {bound:.4f}")
    # The timing law runs along the smooth curve itself.
    assert best.curve is not None
    along = gg.paced(best.curve, gg.Limits(acceleration=1000.0), period=1.0).timed
    assert along is not None

    # A square of the same size may be moved along α2 = −α1. Farther out the tilt costs thrust, farther in two rotors
    # carry the load of all four.
    centers = np.linspace(math.pi / 8, math.pi / 4, 201)
    takes = [largest(mirror * square(center), vehicle) for center in centers]
    center = centers[int(np.argmin(takes))]
    moved = gg.lift(mirror * square(center), "red", vehicle=vehicle)
    before = gg.lift(corners, "red", vehicle=strong)
    compared = (before.parametrize(1.0), along, moved.parametrize(1.0))
    flown[name] = [gg.fly(one, attitude=(0, 0), settings=still) for one in compared]
    for what, flight in zip(
        ("Gait 4", "within 0.2 rad", f"moved to {center:.3f} rad"),
        flown[name],
        strict=True,
    ):
        print(
            f"  {what}: peak in flight {flight.peak_thrust_share:.3f} quarters, "
            f"least singular value {flight.least_singular_value:.3f}"
        )

# %%
# The loops of the paper's vehicle over the map of the largest thrust, in units of the weight, and the thrusts flown.

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.6), layout="constrained")
plots.regions_map(ax=left)
for name, flight, style in zip(
    ("Gait 4", "within 0.2 rad", "moved"),
    flown["paper"],
    ("k--", "r-", "b-"),
    strict=True,
):
    left.plot(flight.column("alpha1"), flight.column("alpha2"), style)
    mass, gravity = flight.vehicle.require(
        "mass", "gravity", purpose="a quarter of the weight"
    )
    right.plot(
        flight.column("t"),
        4 * flight.thrusts.max(axis=1) / (mass * gravity),
        style,
        label=name,
    )
right.axhline(2.4, color="black", linestyle="dotted", linewidth=0.8)
right.set(
    xlabel="t [s]", ylabel="largest thrust [quarter of the weight]", ylim=(0.9, None)
)
right.legend()

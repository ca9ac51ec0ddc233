"""What disturbs a flight: noise of the sensors, gusts, and the rotors as gyroscopes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import arm_angles, thrust_signs

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.flight.engine import Engine
    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.vehicle import Vehicle

    Put = Callable[[Engine, list[float], list[float], tuple[float, ...]], None]

__all__ = ["gusts_of", "gyroscopic_torque_of", "noise_of"]

FloatArray = npt.NDArray[np.float64]

_GUST_TIME = 1.0  # s


def noise_of(settings: FlightSettings, count: int) -> list[list[float]] | None:
    """Return what the sensors err by at every control step (place, attitude, velocity, rates), or None if nothing."""
    sizes = (settings.position_noise, settings.attitude_noise, settings.velocity_noise, settings.rate_noise)
    if not any(sizes):
        return None
    drawn = np.random.default_rng([settings.seed, 0]).standard_normal((count + 1, 12))
    noise: list[list[float]] = (drawn * np.repeat(sizes, 3)).tolist()
    return noise


def gusts_of(settings: FlightSettings, count: int) -> FloatArray | None:
    """Return the wind at every control step, or None if it does not change."""
    if settings.is_calm:
        return None
    from scipy.signal import lfilter

    keep = math.exp(-1.0 / (settings.control_rate * _GUST_TIME))
    drawn = np.random.default_rng([settings.seed, 1]).standard_normal((count + 1, 3))
    drawn[1:] *= math.sqrt(1.0 - keep * keep)
    gusts = settings.gust * lfilter([1.0], [1.0, -keep], drawn, axis=0)
    return np.asarray(np.asarray(settings.wind) + gusts)


def gyroscopic_torque_of(vehicle: Vehicle) -> Put | None:
    """Return what puts the gyroscopic torques of the rotors on the body, where the vehicle states what they need.

    What is about a hinge is borne by its servo, which passes it on to the body too.
    """
    if vehicle.rotor_inertia is None:
        return None
    (coefficient,) = vehicle.require("thrust_coefficient", purpose="the gyroscopic torque of a rotor_inertia")
    momenta = (thrust_signs(vehicle) * vehicle.rotor_inertia).tolist()
    arms = [(math.cos(azimuth), math.sin(azimuth)) for azimuth in arm_angles(vehicle).tolist()]
    sin, cos, sqrt = math.sin, math.cos, math.sqrt

    def put(engine: Engine, tilts: list[float], speed: list[float], thrusts: tuple[float, ...]) -> None:
        _, _, _, p, q, r, *tilt_rates = speed
        t1 = t2 = t3 = 0.0
        for (cz, sz), momentum, tilt, rate, thrust in zip(arms, momenta, tilts, tilt_rates, thrusts, strict=True):
            spun = momentum * math.copysign(sqrt(abs(thrust) / coefficient), thrust)
            # −ω × h in body axes: ω of the arm, h along the tilted rotor axis.
            w1, w2, across, up = p + rate * cz, q + rate * sz, spun * sin(tilt), spun * cos(tilt)
            h1, h2 = sz * across, -cz * across
            t1, t2, t3 = t1 + r * h2 - w2 * up, t2 + w1 * up - r * h1, t3 + w2 * h1 - w1 * h2
        engine.data.qfrc_applied[3:6] = t1, t2, t3

    return put

"""Lagging servos: the transfer function, closed forms, and what the error does to a gait."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.surface.sheets import sheet_distances
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.servo_lag import ServoResponse, servo_response
from gaitgraph.timing.time_optimal import paced
from tests.published import GAITS

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

SQUARE = lift(GAITS[2].angles, "red")
UNEQUAL = [0.05, 0.1, 0.02, 0.05]


@cache
def fast() -> TimedGait:
    limits = Limits(rate=6.0, acceleration=60.0)
    timed = paced(SQUARE, limits, rounding=0.03, nodes=200).timed
    assert timed is not None
    return timed


def error_at(response: ServoResponse, t: Any) -> Any:
    return np.column_stack([np.interp(t, response.t, one) for one in response.error.T])


@pytest.mark.parametrize("timed", [SQUARE.parametrize(1.0), fast()])
@pytest.mark.parametrize("lag", [0.048, [0.01, 0.02, 0.1, 0.2]])
def test_the_response_is_that_of_the_transfer_function(
    timed: TimedGait, lag: Any
) -> None:
    # 1/(1 + iωτ) on every harmonic of the commanded angles.
    n = 8000
    t = np.arange(n) / n
    commanded = timed.at(t).alpha
    harmonics = 2j * np.pi * np.arange(n // 2 + 1)[:, None]
    spectrum = np.fft.rfft(commanded, axis=0) / (1 + harmonics * np.asarray(lag))
    expected = commanded - np.fft.irfft(spectrum, n, axis=0)
    response = servo_response(timed, lag)
    away = np.abs(error_at(response, t) - expected)
    assert away.max() < response.slack.max() + 1e-9
    assert response.rms == pytest.approx(np.sqrt((expected**2).mean(axis=0)), rel=1e-4)
    size = np.abs(response.error)
    at_peak = size[np.searchsorted(response.t, response.peak_times), range(4)]
    np.testing.assert_allclose(at_peak, size.max(axis=0), atol=1e-12)


@pytest.mark.parametrize("tau", [0.01, 0.1, 1.0])
def test_a_triangle_wave_has_its_closed_form(tau: float) -> None:
    """Constant rates ±v, each for half a period: the error settles to v·τ·tanh(T/4τ) at the turns."""
    gait = lift([(0.4, -0.4), (1.2, -0.4)], "red")
    response = servo_response(gait.parametrize(2.0, law="constant-speed"), tau)
    rate, h = 0.8, response.t[1]
    edge = rate * tau * np.tanh(2.0 / (4 * tau))
    half = response.t <= 1.0
    curve = rate * tau - (rate * tau + edge) * np.exp(-response.t[half] / tau)
    np.testing.assert_allclose(response.error[half, 0], curve, atol=1e-12)
    assert not response.error[:, [1, 3]].any()
    most = h**2 / 4 * rate / tau + h * rate  # between times, and beside the commands
    assert response.slack[0] == pytest.approx(min(most, rate * tau - edge))


@settings(deadline=None, max_examples=12)
@given(
    points=st.lists(
        st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=5
    ),
    lag=st.floats(0.005, 3.0),
    law=st.sampled_from(["smooth", "constant-speed", "equal-time"]),
)
@example(points=[(0.0, 0.0), (0.0, 6.5e-71), (0.0, 1.0)], lag=1.0, law="smooth")
def test_errors_are_bounded_and_average_out(points: Any, lag: float, law: Any) -> None:
    timed = lift(points, "red").parametrize(1.0, law=law)
    response = servo_response(timed, lag)
    np.testing.assert_array_equal(response.error[0], response.error[-1])
    assert (response.peak <= lag * timed.peak_rates * (1 + 1e-2) + 1e-12).all()
    # What is commanded and what is attained have the same mean: the error has none.
    mean = np.trapezoid(response.error, response.t, axis=0)
    assert np.abs(mean).max() <= 1e-3 * response.peak.max() + 1e-12
    square = np.trapezoid(response.error**2, response.t, axis=0)
    np.testing.assert_allclose(response.rms**2, square, rtol=1e-9, atol=1e-30)
    # Opposite servos that share a lag err alike, to the last bit.
    np.testing.assert_array_equal(response.error[:, :2], response.error[:, 2:])
    assert response.distance_off_sheet == 0


def test_servos_with_lags_of_their_own_leave_the_sheet() -> None:
    response = servo_response(fast(), [0.048, 0.048, 0.06, 0.048])
    off = sheet_distances(response.actual, SQUARE.coefficients)[..., 0].max()
    assert 0.02 < off <= float(response.distance_off_sheet or 0.0) <= off + 1e-4
    # With one lag for all a blue gait stays on its sheet, as a red one does.
    response = servo_response(lift(GAITS[1].angles, "blue").parametrize(1.0), 0.05)
    assert response.distance_off_sheet == 0
    assert sheet_distances(response.actual, SQUARE.coefficients)[..., 1].max() < 1e-9
    biased = servo_response(SQUARE.biased(0.5).parametrize(1.0), 0.05)
    assert biased.distance_off_sheet is None  # it is on no sheet anyway


@pytest.mark.parametrize(
    ("timed", "lag"),
    [
        (fast(), 0.02),
        (fast(), UNEQUAL),
        (SQUARE.parametrize(1.0, law="constant-speed"), 0.5),
    ],
)
def test_the_least_singular_value_of_the_actual_motion_is_a_lower_bound(
    timed: TimedGait, lag: Any
) -> None:
    response = servo_response(timed, lag)
    t = np.linspace(0, 1, 4001)
    sampled = least_singular_value(timed.at(t).alpha - error_at(response, t)).min()
    assert sampled - 1e-3 <= response.least_singular_value <= sampled + 1e-6


def test_the_vehicle_states_the_lag() -> None:
    vehicle = gg.PAPER.replace(servo_lag=UNEQUAL)
    timed = lift(GAITS[2].angles, "red", vehicle=vehicle).parametrize(1.0)
    response = servo_response(timed)
    assert response.lag.tolist() == response.as_mapping()["lag"] == UNEQUAL
    assert servo_response(timed, 0.048).as_mapping()["lag"] == 0.048
    with pytest.raises(gg.errors.MissingConstant, match="servo_lag"):
        servo_response(SQUARE.parametrize(1.0))

"""Lagging servos: the transfer function, closed forms, and what the error does to a gait."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.surface.sheets import sheet_distances
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.servo_lag import servo_response
from gaitgraph.timing.time_optimal import paced
from tests.published import GAITS

if TYPE_CHECKING:
    from gaitgraph.timing.laws import LawName
    from gaitgraph.timing.timed_gait import TimedGait

SQUARE = lift(GAITS[2].angles, "red")


def fast() -> TimedGait:
    timed = paced(
        SQUARE,
        Limits(rate=6.0, acceleration=60.0),
        period=1.0,
        rounding=0.03,
        nodes=200,
    ).timed
    assert timed is not None
    return timed


@pytest.mark.parametrize(
    "timed", [SQUARE.parametrize(1.0), fast()], ids=["smooth", "paced"]
)
@pytest.mark.parametrize("lag", [0.048, [0.01, 0.02, 0.1, 0.2]])
def test_the_response_is_that_of_the_transfer_function(
    timed: TimedGait, lag: object
) -> None:
    # 1/(1 + iωτ) on every harmonic of the commanded angles.
    n = 8000
    commanded = timed.at(np.arange(n) / n).alpha
    harmonics = 2j * np.pi * np.arange(n // 2 + 1)[:, None]
    attained = np.fft.irfft(
        np.fft.rfft(commanded, axis=0) / (1 + harmonics * np.asarray(lag)), n, axis=0
    )
    response = servo_response(timed, lag)  # type: ignore[arg-type]
    last = response.error[np.searchsorted(response.t, response.peak_times), range(4)]
    np.testing.assert_allclose(
        np.abs(last), np.abs(response.error).max(axis=0), atol=1e-12
    )
    t = np.arange(n) / n
    error = np.column_stack(
        [np.interp(t, response.t, column) for column in response.error.T]
    )
    assert np.abs(commanded - error - attained).max() < response.slack.max() + 1e-9


def test_a_triangle_wave_has_its_closed_form() -> None:
    # Constant rates ±v, each for half a period: the error settles to v·τ·tanh(T/4τ) at the turns.
    gait = lift([(0.4, -0.4), (1.2, -0.4)], "red")
    timed, rate = gait.parametrize(2.0, law="constant-speed"), 0.8
    for tau in (0.01, 0.1, 1.0):
        response = servo_response(timed, tau)
        edge = rate * tau * np.tanh(2.0 / (4 * tau))
        np.testing.assert_allclose(response.error[0], [-edge, 0, -edge, 0], atol=1e-12)
        half = int(np.searchsorted(response.t, 1.0 - 1e-9))
        np.testing.assert_allclose(response.error[half], [edge, 0, edge, 0], atol=1e-12)
        t = response.t[:half]
        curve = rate * tau - (rate * tau + edge) * np.exp(-t / tau)
        np.testing.assert_allclose(response.error[:half, 0], curve, atol=1e-12)
        assert response.peak[0] == pytest.approx(edge, rel=1e-3)
        h = np.diff(response.t).max()
        most = (
            h**2 / 4 * rate / tau + h * rate
        )  # between times, and beside the commands
        assert response.slack[0] == pytest.approx(min(most, rate * tau - edge))
        closed = np.mean(
            (
                rate * tau
                - (rate * tau + edge) * np.exp(-np.linspace(0, 1, 200_001) / tau)
            )
            ** 2
        )
        assert response.rms[0] ** 2 == pytest.approx(closed, rel=1e-5)


@settings(deadline=None, max_examples=12)
@given(
    points=st.lists(
        st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=5
    ),
    lag=st.floats(0.005, 3.0),
    law=st.sampled_from(["smooth", "constant-speed", "equal-time"]),
)
@example(points=[(0.0, 0.0), (0.0, 6.5e-71), (0.0, 1.0)], lag=1.0, law="smooth")
def test_errors_are_bounded_certain_between_samples_and_average_out(
    points: list[tuple[float, float]], lag: float, law: LawName
) -> None:
    timed = lift(points, "red").parametrize(1.0, law=law)
    response = servo_response(timed, lag)
    np.testing.assert_array_equal(response.error[0], response.error[-1])
    assert (np.abs(response.error).max(axis=0) <= response.peak).all()
    assert (response.peak <= lag * timed.peak_rates * (1 + 1e-2) + 1e-12).all()
    assert (response.rms <= response.peak + 1e-12).all()
    # What is commanded and what is attained have the same mean: the error has none.
    h = np.diff(response.t)[:, None]
    mean = (h * (response.error[1:] + response.error[:-1]) / 2).sum(axis=0)
    assert np.abs(mean).max() <= 1e-3 * response.peak.max() + 1e-12
    # Opposite servos that share a lag err alike, to the last bit.
    np.testing.assert_array_equal(response.error[:, :2], response.error[:, 2:])
    assert response.distance_off_sheet == 0
    on_red = sheet_distances(response.actual, timed.gait.coefficients)[..., 0]
    assert on_red.max() < 1e-12


def test_servos_with_lags_of_their_own_leave_the_sheet() -> None:
    response = servo_response(fast(), [0.048, 0.048, 0.06, 0.048])
    off = sheet_distances(response.actual, SQUARE.coefficients)[..., 0].max()
    assert off > 0.02
    assert off <= response.distance_off_sheet <= off + 1e-4
    # The error in α3 moves the gait along α3 alone, so Rθ or Rφ no longer vanish.
    assert (
        np.abs(
            gg.invertibility.roll_sensitivity(response.actual, SQUARE.coefficients)
        ).max()
        > 1e-3
    )
    # With one lag for all a blue gait stays on its sheet, as a red one does.
    response = servo_response(lift(GAITS[1].angles, "blue").parametrize(1.0), 0.05)
    assert response.distance_off_sheet == pytest.approx(0, abs=1e-12)
    assert sheet_distances(response.actual, SQUARE.coefficients)[..., 1].max() < 1e-9
    biased = servo_response(
        SQUARE.biased(0.5).parametrize(1.0), 0.05
    )  # it is on no sheet anyway
    assert (biased.distance_off_sheet, "sheet" in str(biased)) == (None, False)


def test_the_least_singular_value_along_the_actual_motion_is_a_lower_bound() -> None:
    even = SQUARE.parametrize(1.0, law="constant-speed")
    for timed, lag in ((fast(), 0.02), (fast(), [0.05, 0.1, 0.02, 0.05]), (even, 0.5)):
        response = servo_response(timed, lag)
        t = np.linspace(0, 1, 4001)
        error = np.column_stack(
            [np.interp(t, response.t, column) for column in response.error.T]
        )
        sampled = least_singular_value(response.timed.at(t).alpha - error).min()
        assert sampled - 1e-3 <= response.least_singular_value <= sampled + 1e-6


def test_the_vehicle_states_the_lag() -> None:
    timed = lift(
        -SQUARE.alpha[:, :2], "red", vehicle=gg.vehicle_named("beetle_omni")
    ).parametrize(1.0)
    response = servo_response(timed)
    np.testing.assert_array_equal(response.lag, 0.048)
    answer = response.as_mapping()
    assert (answer["lag"], answer["peak_error"][0]) == (0.048, response.peak[0])
    assert "least singular value" in str(response)
    with pytest.raises(gg.errors.MissingConstant, match="servo_lag"):
        servo_response(SQUARE.parametrize(1.0))


def test_the_longest_lag_is_allowed() -> None:
    assert (
        np.ptp(servo_response(SQUARE.parametrize(1.0), 1e6).actual, axis=0).max() < 1e-5
    )

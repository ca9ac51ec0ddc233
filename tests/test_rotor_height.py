"""Rotors above or below the centre of mass: gaits that are planned, judged and flown. Laws of them are tested elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.errors import InputError
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.surface import sign_region
from gaitgraph.surface.red_components import separating_factor
from gaitgraph.vehicle import PAPER

RAISED = PAPER.replace(name="raised", rotor_height=0.15 * 0.1785)
CORNERS = np.array([(3, -3), (3, -1), (1, -1), (1, -3)]) * math.pi / 8


@pytest.mark.parametrize(("height", "flies"), [(0.01, False), (0.1, True)])
def test_blue_is_judged_by_physics(height: float, flies: bool) -> None:
    """Level flight is invertible but the gait is not robust; with rotors high enough it flies."""
    vehicle = PAPER.replace(rotor_height=height)
    gait = gg.lift([(0.9, -0.9), (0.9, -0.4), (0.4, -0.4)], "blue", vehicle=vehicle)
    report = gait.check()
    assert not report.valid
    leans = "on blue the zero-moment direction leans"
    assert leans in report["on_surface"].message
    assert report["least_singular_value"].ok == flies
    assert report["R_sign"].ok
    assert report["hover_thrust"].ok
    pytest.importorskip("mujoco")
    assert gg.fly(gait.parametrize(1.0)).settled == flies


def test_one_color_is_left() -> None:
    exact = coefficients_of(RAISED)
    fibers = gg.roots(exact.delta, 0.1, coefficients=exact).fibers
    assert [fiber.name for fiber in fibers] == ["first"]
    graph = gg.surface_graph("positive", vehicle=RAISED)
    assert {data["color"] for _, data in graph.nodes(data=True)} == {"red"}
    plan = gg.plan_loop(CORNERS, vehicle=RAISED, color="blue", require="valid")
    assert "blue: no gait surface (use red)" in str(plan.reason)
    assert sign_region("positive", RAISED, color="blue").area == 0
    with pytest.raises(InputError, match="rotor height 0.026775 m"):
        coefficients_of(RAISED, "published")
    assert "H = 0.15" in str(separating_factor((0, 0), (-1.55, 0.0), RAISED))


def test_rotors_follow_with_their_lag() -> None:
    """The controller inverts the lag: the thrusts are late by a control step, and the commands lead them."""
    pytest.importorskip("mujoco")
    lagging, prompt = (
        gg.fly(gg.lift([(-0.4, 0.4)], "red", vehicle=vehicle).parametrize(1.0))
        for vehicle in (PAPER.replace(rotor_lag=0.02), PAPER)
    )
    assert lagging.settled
    reached = prompt.thrusts + 0.02 * np.gradient(prompt.thrusts, 1e-3, axis=0)
    assert np.abs(lagging.thrusts - reached)[5:].max() < 0.02
    assert np.abs(lagging.thrusts - prompt.thrusts).max() > 0.05


def test_a_rotor_that_only_pushes_falls_no_faster_than_its_lag() -> None:
    """The hover thrusts of Gait 3 fall with a time constant of 84 ms."""
    pytest.importorskip("mujoco")
    slow = gg.gait_of("gait3", vehicle=PAPER.replace(rotor_lag=0.15)).parametrize(1.0)
    flight = gg.fly(slow, attitude=(0.0, 0.0))
    assert not flight.settled
    assert (flight.saturated_fraction or 0.0) > 0.3

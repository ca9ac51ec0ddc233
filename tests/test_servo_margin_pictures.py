"""Servo margins over the plane: found quickly, on the page's map, and as a figure."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.explorer.map_query import map_answer
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.plots import servo_margin_map
from gaitgraph.robustness import servo_margin


def test_margins_of_postures_are_those_of_the_search() -> None:
    """Postures of both signs of R at once."""
    plane = np.random.default_rng(4).uniform(-1.5, 1.5, (20, 2))
    postures = np.hstack([plane, plane])
    for posture, margin in zip(
        postures, servo_margins_found(postures, gg.PAPER, 0.05), strict=True
    ):
        assert servo_margin(posture[None]).found == pytest.approx(margin, abs=2e-7)


def test_the_map_shades_the_margin() -> None:
    answer = map_answer({"shading": "servo_margin"})
    n = answer["n"]
    values = np.reshape(answer["values"], (n, n))
    axis = np.linspace(-math.pi / 2, math.pi / 2, n)
    for row, column in ((n // 2, n // 2), (44, 20), (12, 50), (3, 3)):
        posture = np.tile([axis[column], axis[row]], 2)
        found = servo_margin(posture[None]).found
        assert found is not None
        assert values[row, column] == pytest.approx(math.degrees(found), abs=0.1)
    blue = map_answer({"shading": "servo_margin", "sheet": "blue"})
    assert blue["values"] is None


def test_its_picture_has_the_margin_of_hover_at_hover() -> None:
    ax = servo_margin_map()
    levels = np.asarray(ax.collections[0].levels)  # type: ignore[attr-defined]
    assert levels.tolist() == list(range(0, 50, 5))
    assert ax.child_axes[0].get_ylabel() == "servo margin (°)"
    with pytest.raises(gg.errors.MissingConstant, match="mass"):
        servo_margin_map(gg.Vehicle(drag_ratio=0.17, max_thrust=12))

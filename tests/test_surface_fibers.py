"""The fibres: that they complete the set of solutions, what holds on them, and that tables on them cannot fly."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.optimize import root

import gaitgraph as gg
from gaitgraph.gait.gait import Gait
from gaitgraph.invertibility.matrices import (
    coefficients_of,
    hover_thrust_shares,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
    rotor_directions,
    zero_moment_direction,
)
from gaitgraph.io.formats import read_table
from gaitgraph.surface.sheets import (
    FIBERS,
    families_along,
    family_distances,
    family_jumps,
    family_types,
    types_contradict,
)

if TYPE_CHECKING:
    from pathlib import Path

HALF_PI = math.pi / 2
EXACT = coefficients_of(kind="exact")
DELTA = EXACT.delta
VEHICLES = {
    "paper": gg.PAPER,
    "small": gg.Vehicle(drag_ratio=0.02),
    "mirrored": gg.PAPER.replace(first_rotor_spin="counterclockwise"),
    "half": gg.Vehicle(drag_ratio=0.5),
    "large": gg.Vehicle(drag_ratio=1.4),
}
CORNERS = [(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)]
every_vehicle = pytest.mark.parametrize("vehicle", VEHICLES.values(), ids=VEHICLES)


def on_fiber(fiber: str, free: Any, coefficients: gg.Coefficients = EXACT) -> np.ndarray:
    """Return points of a fibre with free angles (α2, α4), or (α1, α3) on the second one."""
    free = np.asarray(free, dtype=float)
    fixed = np.full(free.shape[:-1], coefficients.delta if fiber == "fiber1" else -coefficients.delta)
    pairs = (fixed, free[..., 0], fixed, free[..., 1]), (free[..., 0], fixed, free[..., 1], fixed)
    return np.stack(pairs[fiber == "fiber2"], axis=-1)


def gait_on(fiber: str, free: Any, coefficients: gg.Coefficients | None = None) -> Gait:
    coefficients = coefficients or coefficients_of()
    return Gait(alpha=on_fiber(fiber, free, coefficients), colors=(fiber,) * len(free), coefficients=coefficients)


# --- the theorem -----------------------------------------------------------------------------------------------------


@pytest.mark.no_cover
@every_vehicle
def test_a_solver_finds_no_solution_outside_the_four_families(vehicle: gg.Vehicle) -> None:
    """From random angles, of which two are solved for: forces and torques, no formula."""
    rng, exact, found = np.random.default_rng(11), coefficients_of(vehicle, "exact"), []
    for unknown in [list(pair) for pair in itertools.combinations(range(4), 2)] * 20:
        alpha = rng.uniform(-math.pi, math.pi, 4)

        def horizontal(angles: Any, alpha: Any = alpha, unknown: Any = unknown) -> Any:
            alpha[unknown] = angles
            force, torque = rotor_directions(alpha, vehicle)
            # The determinants are 2κ times the horizontal force.
            return [np.linalg.det(np.vstack([torque, force[k]])) / (2 * vehicle.drag_ratio) for k in (0, 1)]

        if np.abs(horizontal(root(horizontal, alpha[unknown], tol=1e-13).x)).max() < 1e-12:
            found.append(alpha)
    assert len(found) > 80
    # A copy of a fibre, a quarter turn away, is singular and none of the four.
    apart, delta = family_distances(found, exact), exact.delta
    copies = np.array(found) - HALF_PI - [delta, -delta, delta, -delta]
    copies = np.abs(copies - math.pi * np.rint(copies / math.pi)).reshape(-1, 2, 2).max(axis=1)
    nearest = np.hstack([apart, copies]).argmin(axis=1)
    assert np.hstack([apart, copies]).min(axis=1).max() < 1e-8
    assert set(nearest.tolist()) == set(range(6))
    singular = np.isin(nearest, [1, 4, 5])
    assert np.abs(level_determinant(found, exact)[singular]).max() < 1e-7 / vehicle.drag_ratio


@every_vehicle
def test_on_a_fibre_R_is_its_closed_form_and_a_pair_idles(vehicle: gg.Vehicle) -> None:
    exact, kappa = coefficients_of(vehicle, "exact"), vehicle.signed_drag_ratio
    free = np.random.default_rng(12).uniform(-1.2, 1.2, (300, 2))
    for fiber, sign, idle in (("fiber1", 1.0, [1, 3]), ("fiber2", -1.0, [0, 2])):
        alpha = on_fiber(fiber, free, exact)
        for residual in (roll_sensitivity, pitch_sensitivity):
            assert np.abs(residual(alpha, exact)).max() < 1e-12 / abs(kappa)
        R = sign * np.sin(free.sum(axis=1) + sign * 2 * exact.delta) / (kappa * math.cos(exact.delta) ** 2)
        np.testing.assert_allclose(level_determinant(alpha, exact), R, atol=1e-11 / abs(kappa))
        assert np.abs(zero_moment_direction(alpha, vehicle)[:, :2]).max() < 1e-12
        shares = hover_thrust_shares(alpha[np.abs(R) > 1e-3], vehicle)
        assert np.abs(shares[:, idle]).max() < 1e-10
        np.testing.assert_allclose((shares * np.cos(alpha[np.abs(R) > 1e-3])).sum(axis=1), 1.0)


# --- families of points ----------------------------------------------------------------------------------------------


def test_points_follow_fibres_where_they_meet_blue_and_sheets_elsewhere() -> None:
    free = np.array([(0.4, 0.4), (0.4, 0.6), (0.2, -0.2 - 2 * DELTA), (0.1, 0.6)])
    alpha = on_fiber("fiber1", free)
    assert families_along(alpha, EXACT, 1e-6).tolist() == [1, 2, 2, 2]
    assert families_along(alpha[2:], EXACT, 1e-6).tolist() == [-1, 2]
    assert families_along(alpha[2:], EXACT, 1e-6, before=2).tolist() == [2, 2]
    assert families_along(alpha[2:], EXACT, 1e-6, before=3).tolist() == [-1, 2]
    assert families_along(alpha + np.array([0, 0, 0.01, 0]), EXACT, 1e-6).tolist() == [0, 0, 0, 0]
    assert families_along(on_fiber("fiber2", free), EXACT, 1e-6).tolist() == [1, 3, 3, 3]


def test_types_on_fibres_hold_one_that_is_free() -> None:
    alpha = np.vstack([on_fiber(fiber, (0.4, 0.9)) for fiber in FIBERS])
    third, fourth = family_types(alpha, [2, 3], EXACT, 0.1)
    assert list(zip(third.tolist(), fourth.tolist(), strict=True)) == [(0, 2), (2, 0)]
    pairs = [(1, 1), (-1, 0), (0, 0), (0, 2), (2, 0)]
    table = {code: types_contradict(pairs, [code] * 5).tolist() for code in (1, -1, 2, 3, 0)}
    assert table == {
        1: [False, True, False, True, True],
        -1: [True, False, False, True, True],
        2: [True, True, True, False, True],
        3: [True, True, True, True, False],
        0: [False] * 5,
    }


def test_segments_leave_a_fibre_by_what_their_ends_do() -> None:
    on = on_fiber("fiber1", [(0.1, 0.8), (0.4, 0.2)])
    red, blue, two = (np.array([code], dtype=np.int8) for code in (1, -1, 2))
    off, turned = on[1:] + np.array([0.01, 0, 0, 0]), on[1:] + np.array([0, 0, math.pi, 0])
    line = on_fiber("fiber1", [(0.3, 0.3)])
    meeting = on_fiber("fiber1", [(0.2, -0.2 - 2 * DELTA)])
    for start, end, codes, after, expected in (
        (on[:1], on[1:], two, two, 0.0),
        (on[:1], off, two, two, 0.01),
        (on[:1], turned, two, two, math.pi),
        (line, on[:1], red, two, 0.0),
        (line - np.array([0.2, 0, 0.2, 0]), on[:1], red, two, 0.2),
        (meeting, on[:1], blue, two, 0.0),
        (on[:1], meeting + np.array([-0.3, 0, 0.3, 0]), two, blue, 0.3),
    ):
        assert family_jumps(start, end, codes, after, EXACT)[0] == pytest.approx(expected, abs=1e-12)


# --- gaits and tables ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["published", "exact"])
@pytest.mark.parametrize(("fiber", "ordinal", "idle", "types"), [
    ("fiber1", "first", "2 and 4", "(?,*)"), ("fiber2", "second", "1 and 3", "(*,?)"),
])  # fmt: skip
def test_a_gait_on_a_fibre_is_valid_and_not_flyable(fiber: str, ordinal: str, idle: str, types: str, kind: Any) -> None:
    free = CORNERS if fiber == "fiber1" else [(-a, -b) for a, b in CORNERS]
    gait = gait_on(fiber, free, coefficients_of(kind=kind))
    report = gait.check()
    assert (report.valid, report.two_color, report.flyable, report.reachable_from_hover) == (True, True, False, True)
    assert [check.name for check in report.checks if not check.ok] == ["hover_thrust"]
    assert f"corner 1 is on the {ordinal} fibre" in report.reason
    assert f"rotors {idle} idle" in report.reason
    assert report["hover_thrust"].value == 0.0
    assert gait.color == fiber
    assert set(gait.types) == {types}


def mixed(coefficients: gg.Coefficients = EXACT) -> Gait:
    """From the red sheet onto both fibres and back, R > 0."""
    at = coefficients.delta
    alpha = [
        (-0.3, 0.5, -0.3, 0.5),
        (at, 0.5, at, 0.5),
        (at, 0.3, at, 0.9),
        (at, 0.2, at, 0.2),
        (-0.2, -at, -0.2, -at),
        (-0.6, -at, -0.1, -at),
        (-0.4, -at, -0.4, -at),
    ]
    colors = ("red", "red", "fiber1", "red", "red", "fiber2", "red")
    return Gait(alpha=np.array(alpha), colors=colors, coefficients=coefficients)


def test_a_gait_goes_from_red_onto_fibres_and_back() -> None:
    report = mixed().check()
    assert (report.valid, report.flyable, report.reachable_from_hover) == (True, False, True)
    assert "corner 3 is on the first fibre" in report.reason
    assert (mixed().color, mixed().types[2], mixed().types[5]) == ("mixed", "(?,*)", "(*,?)")
    for digits in (4, 2):
        rounded = Gait(alpha=mixed().alpha.round(digits), colors=mixed().colors, coefficients=EXACT)
        assert rounded.check()["continuous"].ok == (digits == 4)


def test_jumps_onto_fibres_wrong_colors_and_wraps_are_found() -> None:
    on = on_fiber("fiber1", [(0.3, 0.6), (0.5, 0.9)])
    shifted = mixed().alpha + np.array([[0.0] * 4, [-0.2, 0, -0.2, 0], *[[0.0] * 4] * 5])
    turned = on + np.array([[0, 0, 0, 0], [math.pi, 0, 0, 0]])
    for alpha, colors, value, words in (
        (shifted, mixed().colors, 0.2, "changes color"),
        (on, ("fiber2",) * 2, None, "fiber2 but lies off that fibre, on the fiber1 one"),
        (on, ("red",) * 2, None, "red but lies off that sheet, on the fiber1 one"),
        (turned, ("fiber1",) * 2, math.pi, ""),
    ):
        check = Gait(alpha=alpha, colors=colors, coefficients=EXACT).check()["continuous"]
        assert not check.ok
        assert words in check.message
        assert value is None or check.value == pytest.approx(value)


def test_where_R_is_zero_on_a_fibre_is_no_gait() -> None:
    over = gait_on("fiber1", [(0.3, 0.6), (-0.9, -0.2)], EXACT).check()
    assert "changes its sign" in over["R_sign"].message
    below = gait_on("fiber1", [(-0.9, -0.2), (-0.9, -0.8)], EXACT).check()
    assert (below.valid, below.reachable_from_hover) == (True, False)
    beyond = gait_on("fiber1", [(0.3, 0.6), (-0.9, 2.0)], EXACT).check()
    assert (beyond.valid, beyond.reachable_from_hover) == (True, None)


def test_tables_on_a_fibre_are_recognised_with_and_without_colors(tmp_path: Path) -> None:
    gait_on("fiber1", CORNERS).parametrize(1.0, samples=24).write(tmp_path / "colored.csv")
    table = read_table(tmp_path / "colored.csv")
    assert set(table["color"]) == {"fiber1"}
    assert set(table["types"]) == {"(?,*)"}

    def bare(name: str, alpha: Any) -> Path:
        rows = [",".join(f"{angle:.4f}" for angle in row) for row in alpha]
        (tmp_path / name).write_text("\n".join(["alpha1,alpha2,alpha3,alpha4", *rows]) + "\n")
        return tmp_path / name

    for path in (tmp_path / "colored.csv", bare("bare.csv", table.alpha)):
        report = gg.validate(path)
        assert (report.valid, report.flyable, report.two_color) == (True, False, True)
        assert "row 1 is on the first fibre" in report.reason
        assert not report.notes
        refused = gg.transition("hover", gg.gait_of(read_table(path)))
        assert "on a fibre" in str(refused.reason)
    assert gg.validate(bare("crossing.csv", mixed(coefficients_of()).alpha)).valid

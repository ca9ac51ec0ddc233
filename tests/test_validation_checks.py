"""The checks of valid and flyable, and what can be reached from hover."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import pytest
from scipy.optimize import brentq

import gaitgraph as gg
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
    level_determinant_resolution,
    pitch_sensitivity,
    roll_sensitivity,
)
from gaitgraph.surface.sheets import sheet_distances
from gaitgraph.validation.report import Check, GaitPoint, Report, State, limit_check
from tests.published import GAITS

if TYPE_CHECKING:
    from gaitgraph.vehicle import Spin


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("height", [3e-7, -3e-7, 2e-8, -2e-8])
def test_the_sign_of_R_between_corners_is_decided_below_the_tolerance_of_the_search(
    sign: float, height: float
) -> None:
    # Out and back along a chord beside the curve tan α1 − tan α2 = 2κ: left of it R > 0, right of it R < 0. The chord
    # is moved so far that its least R nearly vanishes.
    exact, a2 = coefficients_of(kind="exact"), np.array([-0.5, 0.1])
    a1, s = (
        np.arctan(2 * gg.PAPER.drag_ratio + np.tan(a2)),
        np.linspace(0, 1, 20001)[:, None],
    )

    def chord(shift: float) -> Gait:
        return lift(np.column_stack([a1 + shift, a2]), "red", coefficients=exact)

    def least(shift: float) -> float:
        start, end = chord(shift).alpha
        return float((sign * level_determinant(start + s * (end - start), exact)).min())

    check = chord(
        brentq(lambda shift: least(shift) - height, -0.2, 0.2, xtol=1e-15)
    ).check()["R_sign"]
    assert (check.decided, check.ok) == (True, height > 0)
    if check.ok:
        assert check.value == pytest.approx(sign * height, abs=1e-6)
        assert (">" if sign > 0 else "<") + " 0 along the whole gait" in check.message


def test_a_report_prints_every_check_and_what_is_beside_them() -> None:
    report = Report(
        checks=(
            Check(
                name="two_color",
                state=State.HOLDS,
                message="all neighbours allowed",
            ),
            Check(
                name="R_sign",
                state=State.UNDECIDED,
                message="undecided " * 14,
            ),
            Check(
                name="hover_thrust",
                state=State.BROKEN,
                message="a rotor pushes down",
            ),
        ),
        reachable_from_hover=None,
        reachability="not decided here",
        notes=("row 3 is odd",),
        unlimited=("thrust_limit", "tilt_range", "tilt_rate"),
        hover_power=1.25,
        hover_power_over="time",
    )
    assert str(report).splitlines() == [
        "Flyable: no. Obeys the paper's rules: yes. Reachable from hover: unknown. "
        "No limit stated of thrust, tilt angle, tilt rate.",
        "  ok  two color             all neighbours allowed",
        "  ??  R sign                undecided undecided undecided undecided undecided undecided undecided undecided",
        "                            undecided undecided undecided undecided undecided undecided",
        "  NO  hover thrust          a rotor pushes down",
        "  --  hover power           1.250 times that of level hover (momentum theory, mean over time)",
        "  --  reachable from hover  not decided here",
        "warning: row 3 is odd",
    ]
    assert report.reason == "a rotor pushes down"
    assert report.warnings == ("undecided " * 14, "row 3 is odd")
    assert set(report.as_mapping()) == {
        "valid",
        "two_color",
        "flyable",
        "reachable_from_hover",
        "repeats",
        "not_judged",
        "hover_power",
        "hover_power_over",
        "checks",
        "warnings",
    }
    with pytest.raises(KeyError, match="nothing"):
        report["nothing"]


def test_a_check_serialises_without_infinities() -> None:
    check = Check(
        name="x",
        state=State.BROKEN,
        message="m",
        value=np.inf,
        limit=np.float64(1.5),
    )
    plain = check.as_mapping()
    assert (plain["value"], plain["limit"], type(plain["limit"]), plain["decided"]) == (
        None,
        1.5,
        float,
        True,
    )


@pytest.mark.parametrize(
    ("peak", "limit", "ok", "message"),
    [
        (2.0, None, True, "peak 2 rad/s (α3); the vehicle states no limit"),
        (2.0, 2.0, True, "peak 2 rad/s (α3), limit 2"),
        (2.0 * (1 + 1e-13), 2.0, True, "peak 2 rad/s (α3), limit 2"),
        (np.inf, None, True, "peak infinite (α3); the vehicle states no limit"),
        (53761.4, 90000.0, True, "peak 53,800 rad/s (α3), limit 90,000"),
        (
            2.1,
            2.0,
            False,
            "peak 2.1 rad/s (α3) at row 1, t = 0.5 s (0.100, 0.200, 0.100, 0.200), limit 2: slower",
        ),
        (
            np.inf,
            5.0,
            False,
            "peak infinite (α3) at row 1, t = 0.5 s (0.100, 0.200, 0.100, 0.200), limit 5: slower",
        ),
    ],
)
def test_messages_of_rate_limits(
    peak: float, limit: float | None, ok: bool, message: str
) -> None:
    place = GaitPoint(point=0, fraction=0.0, alpha=(0.1, 0.2, 0.1, 0.2), t=0.5)
    check = limit_check("tilt_rate", peak, 3, limit, "slower", place)
    assert (check.ok, check.value, check.limit, check.message) == (
        ok,
        peak,
        limit,
        message,
    )


near, DELTA = np.pi / 16, coefficients_of().delta


@pytest.mark.parametrize(
    ("points", "colors", "message"),
    [
        (
            [(0.9, -0.9), (1.0, -0.9)],
            "red",
            "all neighbours allowed by Figure 15 of the paper (red)",
        ),
        (
            [(0.9, -0.9), (1.0, -0.9)],
            "blue",
            "all neighbours allowed by Figure 15 of the paper (blue)",
        ),
        (
            [(near, -near), (np.pi / 8, -near)],
            ["blue", "red"],
            "all neighbours allowed by Figure 15 of the paper (mixed)",
        ),
        (
            [(near, -near), (0.9, -0.9), (1.1, -0.9)],
            ["blue", "red", "red"],
            "all neighbours allowed",
        ),
        (
            [(0.9, -0.9), (1.0, -0.9), (1.1, -0.9)],
            ["red", "red", "blue"],
            "corners 2 (+,+) and 3 (-,-) may not be ",
        ),
        (
            [(0.9, -0.9), (near, -near), (1.1, -0.9)],
            ["red", "red", "blue"],
            "corners 3 (-,-) and 1 (+,+) may not be ",
        ),
    ],
)
def test_messages_of_two_color(points: Any, colors: Any, message: str) -> None:
    gait = lift(points, colors)
    check = gait.check()["two_color"]
    ok = message.startswith("all")
    assert (check.ok, check.value, check.limit, check.kind) == (
        ok,
        1.0 - ok,
        0.0,
        "valid",
    )
    assert check.message.startswith(message)
    if not ok:
        assert check.where is not None
        first = int(message.split()[1]) - 1
        assert (check.where["segment"], check.where["alpha"]) == (
            first,
            gait.alpha[first].tolist(),
        )


def test_gaits_are_checked_with_their_crossing_tolerance() -> None:
    angles = [(np.pi / 16 + 0.05, -np.pi / 16), (np.pi / 8, -np.pi / 16)]
    for tolerance, ok in ((0.2, True), (0.01, False)):
        assert (
            lift(angles, ["blue", "red"], crossing_tolerance=tolerance)
            .check()["two_color"]
            .ok
            is ok
        )


HOME = "the component of α = 0 (tan α1 − tan α2 < 0.3373)"
PLAN_THERE = f"plan with sign positive, in {HOME}, or start the flight in the gait"
CLOSED_OFF = f"entering from hover (R > 0) passes a singular matrix: {PLAN_THERE}"
BLUE_IS_SINGULAR = ": use red, since the whole blue sheet is singular at every attitude in exact physics"
NO_THRUSTS = "no thrusts carry the weight without torque: the moment matrix has rank two on blue; use red"


@pytest.mark.parametrize("keeps", [True, False])
def test_checks_of_a_gait_and_of_the_limits_of_its_vehicle(keeps: bool) -> None:
    limits: dict[str, Any] = (
        {"max_tilt": "70deg", "max_thrust": 3.0}
        if keeps
        else {"max_tilt": "60deg", "max_thrust": 2.0}
    )
    vehicle = gg.PAPER.replace(**limits)
    gait = lift(GAITS[3 if keeps else 2].angles, "red", vehicle=vehicle)
    report = gait.check()
    names = ("closed", "on_surface", "two_color", "continuous", "R_sign")
    physics = {
        "least_singular_value": True,
        "hover_thrust": True,
        "thrust_limit": keeps,
        "tilt_range": keeps,
    }
    found = [(check.name, check.kind, check.ok) for check in report.checks]
    assert found == [(name, "valid", True) for name in names] + [
        (name, "flyable", ok) for name, ok in physics.items()
    ]
    assert (report.flyable, report.reachable_from_hover) == (keeps, keeps)
    in_home = "in the component of α = 0: a flight from hover can enter and leave it"
    assert report.reachability == (in_home if keeps else CLOSED_OFF)
    shares, R, sigma = (
        hover_thrust_shares(gait.alpha),
        np.asarray(gait.R),
        least_singular_value(gait.alpha),
    )
    expected = {
        "closed": (0.0, 0.0, None),
        "on_surface": (0.0, 2e-3, 0),
        "two_color": (0.0, 0.0, None),
        "continuous": (0.0, 2e-3, 0),
        "R_sign": (R.max(), None, int(R.argmax())),
        "least_singular_value": (sigma.min(), 0.05, int(sigma.argmin())),
        "hover_thrust": (shares.min(), 0.0, int(shares.min(axis=1).argmin())),
        "thrust_limit": (
            shares.max() * 0.429 * 9.8,
            vehicle.max_thrust,
            int(shares.max(axis=1).argmax()),
        ),
        "tilt_range": (3 * np.pi / 8, vehicle.max_tilt, 0),
    }
    for name, (value, limit, segment) in expected.items() if not keeps else ():
        check = report[name]
        assert check.decided
        assert check.value == pytest.approx(value, abs=1e-3), name
        assert limit is None or check.limit == pytest.approx(
            limit, rel=1e-12, abs=1e-15
        ), name
        assert (check.where is None) == (segment is None), name
        if check.where is not None:
            assert check.where == {
                "segment": segment,
                "fraction": 0.0,
                "alpha": list(gait.alpha[segment]),
            }, name
            assert check.ok or f"at {place_of(check)}, limit " in check.message
    relation = "R ≥ 0.462 > 0" if keeps else "R ≤ -2.26 < 0"
    assert (
        report["R_sign"].message
        == f"{relation} along the whole gait (published coefficients, angles exact)"
    )


def place_of(check: Check) -> str:
    """The place in words, as messages have it."""
    assert check.where is not None
    between = f" and {100 * check.where['fraction']:.0f} % of the way to the next" * (
        check.where["fraction"] > 0
    )
    angles = ", ".join(f"{angle:.3f}" for angle in check.where["alpha"])
    return f"corner {check.where['segment'] + 1}{between} ({angles})"


@pytest.mark.parametrize("kind", ["published", "exact"])
def test_messages_for_a_blue_gait(kind: str) -> None:
    gait = lift(GAITS[0].angles, "blue", coefficients=coefficients_of(kind=kind))  # type: ignore[arg-type]
    report = gait.check()
    sign, sigma, thrust = (
        report[name] for name in ("R_sign", "least_singular_value", "hover_thrust")
    )
    assert (sigma.ok, sigma.limit) == (False, 0.05)
    assert sigma.value == pytest.approx(
        least_singular_value(gait.alpha).min(), rel=1e-6, abs=1e-15
    )
    assert sigma.message.endswith(
        f"{sigma.value:.3g} at {place_of(sigma)}, floor 0.05{BLUE_IS_SINGULAR}"
    )
    assert (thrust.ok, thrust.value, thrust.limit, thrust.where) == (
        False,
        None,
        0.0,
        None,
    )
    assert (report.reachable_from_hover, report.reachability) == (False, CLOSED_OFF)
    assert (sign.ok, sign.decided) == (
        (False, True) if kind == "exact" else (False, False)
    )
    if kind == "published":
        below = f"|R| falls to {abs(sign.value or 0.0):.2g} at {place_of(sign)}, below the error {sign.limit:.2g} of"
        assert below in sign.message
        assert sign.message.endswith(": use red")


def test_messages_for_a_gait_off_the_surface() -> None:
    """Gait 3, tilted less with its opposite arms: nothing but the paper's rules is broken."""
    gait = lift(GAITS[2].angles, "red").biased(0.8)
    report = gait.check()
    along = gait.alpha + np.linspace(0, 1, 2001)[:, None, None] * (
        gait.ends - gait.alpha
    )
    residual = np.abs(
        [f(along, gait.coefficients) for f in (roll_sensitivity, pitch_sensitivity)]
    ).max()
    surface, colors, continuous = (
        report[name] for name in ("on_surface", "two_color", "continuous")
    )
    assert [(check.kind, check.ok) for check in (surface, colors, continuous)] == [
        ("valid", False)
    ] * 3
    assert surface.value == pytest.approx(residual, abs=1e-4)
    assert (
        f"= {residual:.2g} at {place_of(surface)}, limit 0.002: corner 1 lies on neither sheet: take (α3, α4) from"
        in surface.message
    )
    assert surface.where is not None
    there = np.abs(
        [
            f(surface.where["alpha"], gait.coefficients)
            for f in (roll_sensitivity, pitch_sensitivity)
        ]
    )
    assert there.max() == pytest.approx(
        surface.value, abs=2e-5
    )  # the bracket is as narrow as that
    assert (colors.value, colors.limit, continuous.value, continuous.limit) == (
        1.0,
        0.0,
        None,
        2e-3,
    )
    assert colors.message.startswith(
        f"follows from on_surface: {place_of(colors)} lies on neither sheet and has no color: take (α3, α4)"
    )
    assert continuous.message.startswith(
        f"follows from on_surface: {place_of(continuous)} lies on neither sheet: take (α3, α4)"
    )
    at_first = {"segment": 0, "fraction": 0.0, "alpha": list(gait.alpha[0])}
    assert colors.where == continuous.where == at_first
    other = lift(GAITS[3].angles, "red").biased(0.9).check()
    assert other.reachable_from_hover is None
    assert other.reachability == "not decided: off the red sheet, with R > 0"


@pytest.mark.parametrize(
    ("points", "colors", "value", "limit", "cause"),
    [
        (
            [(-1.3, 0.4), (-1.1, 0.4)],
            "blue",
            np.pi,
            2e-3,
            "it wraps by π or leaves its sheet",
        ),
        (
            [(near, -near), (np.pi / 8, -near)],
            ["blue", "red"],
            2 * (near - DELTA),
            1e-9,
            "it changes color",
        ),
        (
            [(DELTA, -DELTA), (-1.5, 0.3)],
            ["red", "blue"],
            2 * (0.3 + DELTA),
            1e-9,
            "it changes color",
        ),
    ],
)
def test_messages_for_jumps(
    points: Any, colors: Any, value: float, limit: float, cause: str
) -> None:
    check = lift(points, colors).check()["continuous"]
    assert (check.kind, check.ok, check.limit) == ("valid", False, limit)
    assert check.value == pytest.approx(value, abs=1e-12)
    assert (
        f"jumps by {value:.4f} rad (limit {limit:g}) after {place_of(check)}, where {cause}: "
        in check.message
    )
    assert (check.where or {})["segment"] == 0


@pytest.mark.parametrize(("lies", "colored"), [("red", "blue"), ("blue", "red")])
@pytest.mark.parametrize("off", [0.0, 0.1])
def test_messages_for_a_wrong_color(lies: str, colored: str, off: float) -> None:
    """One corner that lies on one sheet and has the color of the other; or that lies on neither."""
    gait = lift([(0.5, -0.7)], lies)
    other = lift([(0.5, -0.7)], colored)
    alpha = gait.alpha + np.array([0, 0, off, 0])
    check = Gait(alpha=alpha, colors=(colored,)).check()["continuous"]
    distance = np.abs(alpha - other.alpha).max()
    beside = f", on the {lies} one" if not off else ""
    assert (check.kind, check.ok, check.limit) == ("valid", False, 2e-3)
    assert check.value == pytest.approx(distance, rel=1e-12)
    assert check.where == {"segment": 0, "fraction": 0.0, "alpha": list(alpha[0])}
    found = f"is colored {colored} but lies off that sheet{beside}, by {distance:.4f} rad (limit 0.002): "
    follows = "follows from on_surface: " if off else ""
    assert check.message.startswith(f"{follows}{place_of(check)} {found}")


@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
@pytest.mark.parametrize("shift", [(0, 0), (np.pi, 0), (0, np.pi), (np.pi, np.pi)])
def test_hover_reaches_red_only_with_opposite_arms_alike(
    spin: Spin, shift: tuple[float, float]
) -> None:
    """An opposite arm turned by π is on red too, but on another part of it."""
    vehicle = gg.PAPER.replace(first_rotor_spin=spin)
    gait = lift(
        (1 if spin == "clockwise" else -1) * np.array(GAITS[3].angles),
        "red",
        vehicle=vehicle,
    )
    moved = Gait(
        alpha=gait.alpha + np.array([0, 0, *shift]), colors=gait.colors, vehicle=vehicle
    )
    report = moved.check()
    reached = shift == (0, 0)
    assert report.reachable_from_hover is reached
    if not reached:
        relation = "< 0.3373" if spin == "clockwise" else "> -0.3373"
        assert (
            f"in the component of α = 0 (tan α1 − tan α2 {relation})"
            in report.reachability
        )
        positive = bool(
            (
                np.asarray(
                    level_determinant(moved.alpha, coefficients_of(vehicle, "exact"))
                )
                > 0
            ).all()
        )
        assert (
            "no path on the surface from hover to this component" in report.reachability
        ) is positive


@pytest.mark.parametrize("kind", ["published", "exact"])
@pytest.mark.parametrize("rounding", [0.0, 1e-12, 5e-4, 0.02])
def test_the_error_of_R_from_the_digits_of_a_point(kind: str, rounding: float) -> None:
    """Of one point it is what is documented there; of a gait at least that of each of its corners."""
    coefficients = coefficients_of(kind=kind)  # type: ignore[arg-type]
    limits = []
    for point in GAITS[3].angles:
        gait = lift([point], "red", coefficients=coefficients)
        limit = gait.check(angle_rounding=rounding)["R_sign"].limit
        carried = level_determinant_resolution(gait.alpha, coefficients, rounding)[0]
        assert limit == pytest.approx(carried, rel=5e-3, abs=0.0)
        limits.append(carried)
    whole = (
        lift(GAITS[3].angles, "red", coefficients=coefficients)
        .check(angle_rounding=rounding)["R_sign"]
        .limit
    )
    assert whole is not None
    assert max(limits) * (1 - 1e-9) <= whole < 4 * max(limits)


def test_rounding_is_inferred_unless_it_is_given() -> None:
    """The largest distance from the sheet, as far as the tolerance takes it for rounding."""
    gait = lift(GAITS[3].angles, "red")
    printed = Gait(alpha=gait.alpha + np.array([0, 0, 3e-4, -7e-4]), colors=gait.colors)
    limits = [
        printed.check(angle_rounding=rounding)["R_sign"].limit
        for rounding in (None, 7e-4, 3e-4, 0.0)
    ]
    assert limits[0] == pytest.approx(limits[1], rel=1e-9)
    assert limits[0] > limits[2] > limits[3]  # type: ignore[operator]
    bent = Gait(
        alpha=gait.alpha + np.outer([0, 1, 0, 0], [0, 0, 0, 0.1]), colors=gait.colors
    )
    assert (
        bent.check()["R_sign"].limit == bent.check(angle_rounding=0.0)["R_sign"].limit
    )


@pytest.mark.parametrize(
    "colors",
    [["blue", "blue", "red", "red", "red"], ["red", "blue", "blue", "red", "red"]],
)
def test_one_blue_corner_fails_at_any_position(colors: list[str]) -> None:
    points = [(0.5, -0.7), (0.6, -0.7), (0.6, -0.8), (0.5, -0.8), (0.4, -0.8)]
    for kind in ("published", "exact"):
        report = lift(points, colors, coefficients=coefficients_of(kind=kind)).check()
        assert report["hover_thrust"].message.endswith(NO_THRUSTS)
        assert report["least_singular_value"].message.endswith(BLUE_IS_SINGULAR)
        assert report.reachable_from_hover is False
        assert ("R = 0 on the whole blue sheet" in report["R_sign"].message) is (
            kind == "exact"
        )


@pytest.mark.parametrize("gait", GAITS[:2], ids=["gait 1", "gait 2"])
def test_printed_digits_decide_the_sign_of_R_and_nothing_else(gait: Any) -> None:
    published, printed = (
        lift(gait.angles, "blue", coefficients=coefficients_of(kind=kind)).check()
        for kind in ("published", "printed")
    )
    sign, undecided = printed["R_sign"], published["R_sign"]
    assert (undecided.decided, undecided.ok, published.valid) == (False, False, True)
    assert (sign.decided, sign.ok, printed.valid) == (True, True, True)
    assert (sign.value or 0.0) < 0
    assert "< 0 along the whole gait (printed coefficients, angles" in sign.message
    assert not printed.flyable
    for check in printed.checks:
        if check.kind == "flyable":
            assert check == published[check.name]


@pytest.mark.parametrize("ratio", [gg.PAPER.drag_ratio, 0.05, 0.25])
def test_a_floor_within_the_bracket_of_the_least_singular_value_is_decided(
    ratio: float,
) -> None:
    """Off the sheets the bracket is about 1e-4 wide; the comparison with the floor is decided to within 1e-6."""
    gait = lift(GAITS[2].angles, "red", vehicle=gg.Vehicle(drag_ratio=ratio)).biased(
        0.8
    )
    s = np.linspace(0, 1, 4001)[:, None, None]
    least = float(
        least_singular_value(
            gait.alpha + s * (gait.ends - gait.alpha), gait.vehicle
        ).min()
    )
    for apart in (2e-6, 1e-5, 4e-5):
        assert gait.check(floor=least - apart)["least_singular_value"].ok
        assert not gait.check(floor=least + apart)["least_singular_value"].ok


@pytest.mark.parametrize("turn", range(4))
def test_the_place_that_cannot_hover_is_reported_for_any_start_of_the_gait(
    turn: int,
) -> None:
    """Between corners 1 and 2 of the unturned gait the thrusts are positive; at 3 alone they are not."""
    points = np.roll([(0.9, -0.9), (1.0, -0.9), (0.9, 0.9), (0.8, -0.9)], turn, axis=0)
    gait = lift(points, "red")
    s = np.linspace(0, 1, 2001)[:, None, None]
    shares = hover_thrust_shares(gait.alpha + s * (gait.ends - gait.alpha)).min(
        axis=(0, 2)
    )
    check = gait.check()["hover_thrust"]
    assert (
        f"not positive (least -2.6 of m·g) at {place_of(check)}: keep" in check.message
    )
    assert check.where is not None
    assert check.where["segment"] in (
        int(np.argmax(shares <= 0)),
        (int(np.argmax(shares <= 0)) + 1) % 4,
    )
    assert check.where["alpha"] == pytest.approx([0.9, 0.9, 0.9, 0.9])
    assert check.value == pytest.approx(hover_thrust_shares(gait.alpha).min())


def test_a_small_change_of_color_is_reported_beside_larger_deviations_within_tolerance() -> (
    None
):
    """Within one color the digits may be off by the tolerance; between colors nothing may."""
    delta = coefficients_of().delta
    gait = lift(
        [(delta + 5e-5, -delta - 5e-5), (0.4, -0.4), (0.4, -0.3)],
        ["blue", "red", "red"],
    )
    printed = Gait(
        alpha=gait.alpha + np.outer([0, 0, 1], [0, 0, 1e-3, 0]), colors=gait.colors
    )
    check = printed.check()["continuous"]
    assert not check.ok
    assert check.value == pytest.approx(1e-4, rel=1e-6)
    assert (check.limit, check.where and check.where["segment"]) == (1e-9, 0)
    assert "changes color" in check.message


def test_a_row_at_a_corner_of_the_square_leaks_no_warning() -> None:
    report = lift(
        [(np.pi / 2, -np.pi / 2), (0.8, -0.7)], "red"
    ).check()  # warnings of numpy are errors in the tests
    assert not report.flyable


def test_tilts_on_both_sides_of_the_limit() -> None:
    for limit, ok in (
        (0.25, False),
        (0.3, True),
        (0.3 - 0.9e-9, True),
        (0.3 - 1.1e-9, False),
    ):
        vehicle = gg.PAPER.replace(max_tilt=limit)
        check = lift([(0.2, -0.1), (0.2, -0.3)], "red", vehicle=vehicle).check()[
            "tilt_range"
        ]
        assert (check.ok, check.value, check.limit, (check.where or {})["segment"]) == (
            ok,
            0.3,
            limit,
            1,
        )
        assert (
            ok
            or "(α2) at corner 2 (0.200, -0.300, 0.200, -0.300), limit" in check.message
        )


def test_reachability_uses_exact_coefficients() -> None:
    """R is 1e-5, far more than floating point makes of zero, and far less than three printed digits carry."""
    a2 = -0.2
    kappa = gg.PAPER.drag_ratio
    a1 = brentq(
        lambda x: (
            float(level_determinant([x, a2, x, a2], coefficients_of(kind="exact")))
            - 1e-5
        ),
        -0.2,
        np.arctan(2 * kappa + np.tan(a2)),
    )
    report = lift([(a1, a2)], "red").check()
    assert not report["R_sign"].decided
    assert report.reachable_from_hover is True
    sign = lift([(a1, a2), (0.0, a2)], "red").check()[
        "R_sign"
    ]  # certain at the second corner alone
    assert (sign.ok, sign.decided, "|R| falls to" in sign.message) == (
        False,
        False,
        True,
    )
    beyond = lift([(a1 + 1e-4, a2)], "red").check()
    assert beyond.reachable_from_hover is False


@pytest.mark.parametrize(
    ("point", "home"),
    [((-1.55, 1.5), False), ((-1.5, 1.55), False), ((-0.9, 0.9), True)],
)
def test_the_component_is_that_of_both_angles(
    point: tuple[float, float], home: bool
) -> None:
    """R > 0 with a straight path from α = 0 is home; the small components in the corner are not."""
    gait = lift([point], "red")
    R = np.asarray(
        level_determinant(
            np.linspace(0, 1, 4001)[:, None] * gait.alpha[0],
            coefficients_of(kind="exact"),
        )
    )
    assert R[-1] > 0
    assert bool((R > 0).all()) is home
    assert gait.check().reachable_from_hover is home


@pytest.mark.parametrize(("factor", "ok"), [(1.0, True), (1 - 1e-9, False)])
def test_a_value_at_its_tolerance_is_within_it(factor: float, ok: bool) -> None:
    """A blue row beside blue, as far as the tolerance, is on blue; so is the rounding that is inferred."""
    moved = Gait(
        alpha=lift([(0.5, -0.7)], "blue").alpha + np.array([0, 0, 2.0**-9, 0]),
        colors=("blue",),
    )
    tolerance = float(sheet_distances(moved.alpha, moved.coefficients)[0, 1]) * factor
    report = moved.check(tolerance=tolerance)
    assert report["continuous"].ok is ok
    assert report["hover_thrust"].message.endswith(NO_THRUSTS) is ok
    known, inferred = (
        moved.check(tolerance=tolerance, angle_rounding=0.0)["R_sign"].limit,
        report["R_sign"].limit,
    )
    assert (inferred != known) is ok


@pytest.mark.parametrize("turned", [[0, 0, 0.01, 0], [0, 0, 0, 0.01]])
def test_hover_is_not_decided_where_one_arm_alone_leaves_red(
    turned: list[float],
) -> None:
    report = Gait(
        alpha=lift([(0.1, 0.0)], "red").alpha + turned, colors=("red",)
    ).check()
    assert report.reachability.startswith("not decided")


def test_hover_thrusts_that_are_no_numbers_are_not_positive() -> None:
    """Off the surfaces by the name of no color, but exactly where no thrusts carry the weight."""
    vehicle = gg.PAPER.replace(
        drag_ratio=0.004652334215179169, first_arm_angle=-0.9750201267805285
    )
    first = [
        -0.21748872218123916,
        -0.2263425738234366,
        0.22679332348172546,
        0.2170379725229503,
    ]
    second = [
        0.14146998656354937,
        0.1323386938841839,
        -0.13216538526306307,
        -0.1416432951846702,
    ]
    with np.errstate(invalid="ignore"):
        report = gg.validate(
            gg.Gait(alpha=[first, first, second], vehicle=vehicle), tolerance=1e-3
        )
    assert not report["hover_thrust"].ok


# -- What a verdict does not cover

EVERY = ("thrust_limit", "tilt_range", "tilt_rate", "tilt_acceleration")
LIMITS: dict[str, Any] = {
    "thrust_limit": {"max_thrust": 9.0},
    "tilt_range": {"max_tilt": 1.5},
    "tilt_rate": {"max_tilt_rate": 99.0},
    "tilt_acceleration": {"max_tilt_acceleration": 9999.0},
}
NOT_JUDGED = "No limit stated of thrust, tilt angle, tilt rate, tilt acceleration."
LOOP = [(-0.8, 0.8), (-0.8, 0.4), (-0.4, 0.4)]


def powers(alpha: Any, vehicle: Any = gg.PAPER) -> Any:
    """Return the sum of f^1.5 over its value in hover, by the definition; at α = 0 each rotor has a quarter."""
    shares = hover_thrust_shares(alpha, vehicle)
    return (shares**1.5).sum(axis=-1) / (4 * 0.25**1.5)


def along(gait: Gait, count: int = 200_001) -> Any:
    """Return the mean power over the length of a loop, by dense sampling."""
    ends = np.vstack([gait.alpha, gait.alpha[:1]])
    lengths = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    s = (np.arange(count) + 0.5) / count * lengths.sum()
    at = np.concatenate([[0.0], lengths.cumsum()])
    points = np.column_stack([np.interp(s, at, column) for column in ends.T])
    return powers(points, gait.vehicle).mean()


@pytest.mark.parametrize("name", EVERY)
def test_conditions_without_a_limit_are_named(name: str) -> None:
    timed = lift(LOOP, "red").parametrize()
    plain = gg.validate(timed)
    assert plain.not_judged == EVERY
    assert plain.verdict.endswith(NOT_JUDGED)
    vehicle = gg.PAPER.replace(**LIMITS[name])
    limited = gg.validate(lift(LOOP, "red", vehicle=vehicle).parametrize())
    assert limited.flyable
    assert limited.not_judged == tuple(other for other in EVERY if other != name)
    limits = {key: value for one in LIMITS.values() for key, value in one.items()}
    whole = gg.PAPER.replace(**limits)
    judged = gg.validate(lift(LOOP, "red", vehicle=whole).parametrize())
    assert judged.flyable
    assert judged.not_judged == ()
    assert judged.verdict.endswith("Reachable from hover: yes.")


def test_limits_of_a_file_count_as_stated(run: Any) -> None:
    run("pace", "gait3", "--max-acceleration", 40, "--output", "paced.csv")
    report = gg.validate("paced.csv")
    assert report["tilt_acceleration"].limit == 40
    assert report.not_judged == EVERY[:3]


def test_every_answer_with_a_verdict_names_what_was_not_judged(run: Any) -> None:
    (Path("request.toml")).write_text(f"waypoints = {[list(one) for one in LOOP]}")
    run("plan", "request.toml", "--output", "gait.csv")
    for command, judged in (
        ("plan request.toml", ()),
        ("validate gait.csv", ()),
        ("validate request.toml", ()),
        ("pace gait.csv --max-acceleration 40", EVERY[3:]),
        ("transition hover gait.csv", ()),
        ("retarget gait.csv", ()),
        ("export gait.csv out.json --force", ()),
        ("optimize --waypoint=-0.8,0.8 --waypoint=-0.4,0.4", ()),
    ):
        names = [name for name in EVERY if name not in judged]
        answer = run(*command.split(), "--json").json
        assert answer["not_judged"] == names, command
        assert answer["hover_power"] > 1, command
        text = NOT_JUDGED.replace(
            ", tilt acceleration", "" if judged else ", tilt acceleration"
        )
        assert f"Reachable from hover: yes. {text}" in run(*command.split()).out, (
            command
        )
    rows = np.array([[0.0, 0.0, 0.0, 0.0], [-0.3, 0.3, -0.3, 0.3]])
    for vehicle, names in (
        (gg.PAPER, [*EVERY]),
        (gg.PAPER.replace(max_tilt=1.0), [*EVERY[:1], *EVERY[2:]]),
    ):
        geometry = gg.invertibility.Geometry.of_vehicle(vehicle)
        report = gg.validation.validate_geometry(rows, geometry)
        assert report.as_mapping()["not_judged"] == list(report.not_judged) == names
        assert "No limit stated of thrust, " in str(report).splitlines()[0]


def test_more_than_half_of_the_weight_on_a_rotor_is_told() -> None:
    def told(shift: float, **limits: Any) -> list[str]:
        vehicle = gg.PAPER.replace(**limits)
        report = gg.validate(lift([(at + shift, -at - shift)], "red", vehicle=vehicle))
        return [one for one in report.warnings if "of m·g" in one]

    def peak(shift: float) -> float:
        angle = at + shift
        return float(hover_thrust_shares([angle, -angle, angle, -angle]).max())

    at = brentq(
        lambda angle: hover_thrust_shares([angle, -angle] * 2).max() - 0.5, 0.7, 1.4
    )
    assert told(-1e-6) == []
    assert peak(-1e-6) < 0.5 < peak(0.1)
    ratio = f"{4 * peak(0.1):.3g}"
    assert told(0.1) == [
        f"a rotor pushes with up to {peak(0.1):.3g} of m·g in hover, a thrust-to-weight ratio of {ratio}; "
        "the vehicle states no max_thrust"
    ]
    assert told(0.1, max_thrust=9.0) == []


@pytest.mark.parametrize("vehicle", ["paper", "beetle_omni"])
def test_hover_power_is_the_mean_of_dense_samples(vehicle: str) -> None:
    for points in (
        LOOP,
        [(-1.1, 1.1), (-1.1, 0.4), (-0.4, 0.4)],
        [(0.9, -0.9), (1.2, -0.6)],
    ):
        gait = lift(points, "red", vehicle=vehicle)
        report = gg.validate(gait)
        assert report.flyable
        assert report.hover_power == pytest.approx(along(gait), rel=1e-6)
        assert report.hover_power_over == "length"
        for law in get_args(gg.timing.laws.LawName):
            timed = gait.parametrize(3.0, law=law, samples=60)
            t = (np.arange(50_001) + 0.5) / 50_001 * 3.0
            expected = powers(timed.at(t).alpha, gait.vehicle).mean()
            report = gg.validate(timed)
            assert report.hover_power == pytest.approx(expected, rel=1e-6)
            assert report.hover_power_over == "time"


@pytest.mark.parametrize("count", [4, 60, 5000])
@pytest.mark.parametrize("closed", [True, False])
def test_hover_power_of_rows_is_that_of_the_rows_as_joined(
    count: int, closed: bool
) -> None:
    rng = np.random.default_rng(count)
    gait = lift(LOOP, "red")
    alpha = gait.parametrize(samples=count, law="constant-speed").alpha[
        : None if closed else -1
    ]
    t = np.append(0.0, np.cumsum(rng.uniform(0.5, 1.5, len(alpha) - 1)))
    columns = dict(zip(("alpha1", "alpha2", "alpha3", "alpha4"), alpha.T, strict=True))
    report = gg.validate(gg.Table(columns=columns))
    assert report.hover_power == pytest.approx(along(Gait(alpha=alpha)), rel=1e-5)
    assert report.hover_power_over == "length"
    if closed:
        s = (np.arange(400_001) + 0.5) / 400_001 * t[-1]
        joined = np.column_stack([np.interp(s, t, column) for column in alpha.T])
        report = gg.validate(gg.Table(columns=columns | {"t": t}))
        assert report.hover_power == pytest.approx(powers(joined).mean(), rel=1e-5)
        assert report.hover_power_over == "time"


def test_hover_power_of_hover_is_one_and_does_not_exist_where_a_rotor_would_pull() -> (
    None
):
    assert gg.validate(lift([(0.0, 0.0)], "red")).hover_power == pytest.approx(1.0)
    tilted = gg.PAPER.replace(rotor_height=0.03)
    assert gg.validate(
        lift([(0.0, 0.0)], "red", vehicle=tilted)
    ).hover_power == pytest.approx(1.0)
    for gait in (
        lift([(0.4, 0.4), (0.9, 0.4)], "blue"),
        lift([(0.3, 0.3), (0.6, 0.3)], "red"),
        lift([(-0.4, 0.4), (0.4, 0.4), (0.4, -0.4)], "red"),
    ):
        for one in (gait, gait.parametrize()):
            report = gg.validate(one)
            assert not report["hover_thrust"].ok
            assert report.hover_power is None
            assert report.as_mapping()["hover_power"] is None
            assert "hover power" not in str(report)


def test_compare_shows_the_power_and_what_was_not_judged(run: Any) -> None:
    gaits = run("compare", "gait3", "gait1", "--json").json["gaits"]
    timed = lift(GAITS[2].angles, "red").parametrize()
    assert gaits[0]["hover_power"] == pytest.approx(gg.validate(timed).hover_power)
    assert gaits[1]["hover_power"] is None
    assert gaits[0]["not_judged"] == list(EVERY)
    out = run("compare", "gait3", "gait1").out
    assert "hover power (of level hover)        1.985" in out
    assert "not judged                          thrust, tilt angle, tilt rate" in out


def test_a_thrust_that_vanishes_is_printed_as_0() -> None:
    delta = coefficients_of(gg.PAPER, "exact").delta
    rows = [[delta, -delta, delta, -delta], [delta, -delta, delta + 1.0, -delta]]
    message = gg.validate(rows)["hover_thrust"].message
    assert message.startswith(
        "hover thrusts are not positive (least 0 of m·g) at row 1"
    )

"""The checks of valid and flyable, and what can be reached from hover."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import gaitgraph as gg
from gaitgraph.checks import stretch_of
from gaitgraph.gait import Gait, lift
from gaitgraph.invertibility import (
    coefficients_of,
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
)
from gaitgraph.reports import Check, Report
from gaitgraph.rules import limit_check
from gaitgraph.stretches import Place
from tests.published import GAITS, PublishedGait


@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
def test_the_four_gaits(gait: PublishedGait) -> None:
    report = gg.validate(lift(gait.angles, gait.color))
    assert report
    assert report.valid
    assert report.two_color
    assert report.flyable is gait.flyable
    assert report.reachable_from_hover is gait.reachable
    assert report["R_sign"].decided is (gait.color == "red")


@pytest.mark.parametrize("rounding", [None, 5e-4])
@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
def test_the_four_gaits_as_printed(gait: PublishedGait, rounding: float | None) -> None:
    """Three printed decimals are still on the surface, and R of Gaits 1 and 2 stays undecided."""
    for angles in (np.array(gait.angles), np.round(gait.angles, 3)):
        printed = Gait(alpha=np.column_stack([angles, gait.printed]), colors=(gait.color,) * 4)
        report = gg.validate(printed, angle_rounding=rounding)
        assert report.valid
        assert report["R_sign"].decided is (gait.color == "red")
        assert report.flyable is gait.flyable
        assert report.reachable_from_hover is gait.reachable


def test_rotors_tilted_beyond_a_quarter_turn_do_not_hover() -> None:
    for alpha in ([np.pi] * 4, [0.0, 0.0, np.pi, np.pi]):
        report = gg.validate(Gait(alpha=[alpha], colors=("red",)))  # type: ignore[arg-type]
        assert not report.flyable
        assert not report["hover_thrust"].ok
        assert not report.reachable_from_hover


def test_least_singular_values_of_gaits_3_and_4() -> None:
    """Against dense sampling; 0.454 and 0.321 to three digits."""
    for gait, expected in ((GAITS[2], 0.454), (GAITS[3], 0.321)):
        lifted = lift(gait.angles, gait.color)
        s = np.linspace(0, 1, 4001)[:, None, None]
        dense = least_singular_value(lifted.alpha + s * (lifted.ends - lifted.alpha)).min()
        check = lifted.check()["least_singular_value"]
        assert check.value == pytest.approx(dense, abs=2e-4)
        assert check.value == pytest.approx(expected, abs=5e-4)


@settings(deadline=None, max_examples=80)
@given(
    points=st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), min_size=1, max_size=4),
    spin=st.sampled_from(["clockwise", "counterclockwise"]),
)
def test_flyable_means_what_dense_sampling_shows(points: list[tuple[float, float]], spin: str) -> None:
    vehicle = gg.PAPER.replace(first_rotor_spin=spin)
    gait = lift(points, "red", vehicle=vehicle)
    report = gait.check()
    s = np.linspace(0, 1, 801)[:, None, None]
    along = gait.alpha + s * (gait.ends - gait.alpha)
    exact = coefficients_of(vehicle, "exact")
    R = level_determinant(along, exact)
    if report.flyable:
        assert least_singular_value(along, vehicle).min() >= 0.05
        assert hover_thrust_shares(along, vehicle).min() > 0
        assert R.min() * R.max() > 0
        assert report["hover_thrust"].value == pytest.approx(hover_thrust_shares(along, vehicle).min(), abs=2e-3)
    elif R.min() * R.max() > 0 and least_singular_value(along, vehicle).min() > 0.0505:
        # The only other reason is a thrust that is not positive somewhere, or a factor of R that vanishes.
        assert hover_thrust_shares(along, vehicle).min() < 1e-3
    # The published coefficients of the paper's vehicle carry R to about 1e-3.
    if R.min() * R.max() < 0 and min(abs(R.min()), abs(R.max())) > 5e-3:
        assert not report.valid
        assert not report["R_sign"].ok


@settings(deadline=None, max_examples=60)
@given(a=st.tuples(st.floats(-1.3, 1.3), st.floats(-1.3, 1.3)))
def test_reachable_from_hover_means_a_path_without_a_singular_matrix(a: tuple[float, float]) -> None:
    """A straight way from α = 0 with R > 0 proves that it can be reached; R < 0 proves that it cannot."""
    gait = lift([a], "red")
    exact = coefficients_of(kind="exact")
    s = np.linspace(0, 1, 501)[:, None]
    straight = s * gait.alpha[0]
    clear = level_determinant(straight, exact).min() > 1e-6
    if clear:
        assert gait.check().reachable_from_hover is True
    if level_determinant(gait.alpha, exact)[0] < 0:
        assert gait.check().reachable_from_hover is False


def test_the_small_components_with_positive_R_are_not_reachable() -> None:
    gait = lift([(-1.55, 1.5)], "red")
    assert level_determinant(gait.alpha, coefficients_of(kind="exact"))[0] > 0
    assert gait.check().reachable_from_hover is False


def test_a_step_over_the_saddle_is_caught_between_corners() -> None:
    """Both ends have R > 0, the straight way between them does not."""
    gait = lift([(-1.5, -1.0), (-1.2, 1.2), (1.35, 1.2)], "red")
    assert (gait.R > 0).all() or (gait.R < 0).any()
    dense = np.linspace(0, 1, 2001)[:, None, None]
    R = level_determinant(gait.alpha + dense * (gait.ends - gait.alpha), gait.coefficients)
    assert gait.check()["R_sign"].ok is bool(R.min() > 0)


def test_exact_blue_is_not_valid_and_says_why() -> None:
    report = lift(GAITS[1].angles, "blue", coefficients=coefficients_of(kind="exact")).check()
    assert not report
    assert "R = 0 on the whole blue sheet" in report.reason
    assert not report["hover_thrust"].ok


def test_a_biased_gait_is_off_the_surface() -> None:
    report = lift(GAITS[2].angles, "red").biased(0.8).check()
    assert not report["on_surface"].ok
    assert not report["two_color"].ok
    assert not report["continuous"].ok
    assert report["R_sign"].ok


def test_a_biased_gait_with_positive_R_leaves_reachability_open() -> None:
    assert lift(GAITS[3].angles, "red").biased(0.9).check().reachable_from_hover is None


def test_colors_that_figure_15_forbids_are_named() -> None:
    report = lift([(0.9, -0.9), (1.1, -0.9)], ["red", "blue"]).check()
    assert not report.two_color
    assert "corners 1 (+,+) and 2 (-,-)" in report["two_color"].message
    assert not report["continuous"].ok


def test_a_color_change_at_a_crossing_obeys_figure_15_but_jumps() -> None:
    """At (π/16, −π/16) the planes are 0.0585 rad apart: twice the distance from the crossing line."""
    gait = lift([(np.pi / 16, -np.pi / 16), (np.pi / 8, -np.pi / 16)], ["blue", "red"])
    report = gait.check()
    assert report.two_color
    assert not report["continuous"].ok
    assert not report.valid
    jump = 2 * (np.pi / 16 - coefficients_of().delta)
    assert report["continuous"].value == pytest.approx(jump, abs=1e-12)
    assert round(jump, 4) == 0.0585


def test_a_wrap_is_a_jump_by_pi() -> None:
    gait = lift([(-1.3, 0.4), (-1.1, 0.4)], "blue")
    assert gait.check()["continuous"].value == pytest.approx(np.pi, abs=0.5)
    assert not gait.check().valid


def test_vehicle_limits() -> None:
    points = GAITS[3].angles
    weak = lift(points, "red", vehicle=gg.PAPER.replace(max_thrust=2.0)).check()
    strong = lift(points, "red", vehicle=gg.PAPER.replace(max_thrust=3.0)).check()
    assert not weak.flyable
    assert strong.flyable
    s = np.linspace(0, 1, 2001)[:, None, None]
    gait = lift(points, "red")
    dense = hover_thrust_shares(gait.alpha + s * (gait.ends - gait.alpha)).max() * 0.429 * 9.8
    assert weak["thrust_limit"].value == pytest.approx(dense, abs=2e-3)
    narrow = lift(points, "red", vehicle=gg.PAPER.replace(max_tilt="60deg")).check()
    assert not narrow["tilt_range"].ok
    assert lift(points, "red", vehicle=gg.PAPER.replace(max_tilt="67.5deg")).check()["tilt_range"].ok


def test_a_thrust_limit_needs_the_mass() -> None:
    vehicle = gg.Vehicle(drag_ratio=0.17, max_thrust=3.0)
    with pytest.raises(gg.MissingConstant, match="mass"):
        lift(GAITS[2].angles, "red", vehicle=vehicle).check()


def test_reports_print_and_serialise() -> None:
    report = lift(GAITS[0].angles, "blue").check()
    text = str(report)
    assert text.startswith("valid yes · flyable no · reachable from hover no")
    assert "??  R sign" in text
    plain = json.loads(json.dumps(report.as_mapping(), allow_nan=False))
    assert {"name", "ok", "value", "limit", "where", "message"} <= set(plain["checks"][0])
    assert plain["warnings"]
    with pytest.raises(KeyError):
        report["nothing"]


@pytest.mark.parametrize("name", ["tolerance", "floor", "angle_rounding"])
@pytest.mark.parametrize("value", [float("nan"), -1.0, float("inf"), "x"])
def test_limits_are_checked(name: str, value: object) -> None:
    with pytest.raises(gg.InputError, match=f"{name}: .* allowed is a finite number"):
        lift(GAITS[2].angles, "red").check(**{name: value})


def test_no_tolerance_at_all_is_a_tolerance() -> None:
    assert lift(GAITS[2].angles, "red").check(tolerance=0).valid


class TestSignBetweenCorners:
    """R that nearly vanishes between corners is decided as far as floating point goes."""

    EXACT = coefficients_of(kind="exact")

    def chord(self, shift: float, size: float = 0.3) -> Gait:
        """Return an out-and-back gait along a chord beside the curve tan α1 − tan α2 = 2κ."""
        a2 = np.array([-0.2 - size, -0.2 + size])
        a1 = np.arctan(2 * gg.PAPER.drag_ratio + np.tan(a2)) + shift
        return lift(np.column_stack([a1, a2]), "red", coefficients=self.EXACT)

    def least(self, shift: float, sign: float) -> float:
        gait = self.chord(shift)
        s = np.linspace(0, 1, 20001)[:, None]
        return float((sign * level_determinant(gait.alpha[0] + s * (gait.alpha[1] - gait.alpha[0]), self.EXACT)).min())

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    @pytest.mark.parametrize("height", [3e-7, -3e-7, 2e-8, -2e-8])
    def test_it_is_decided_below_the_tolerance_of_the_search(self, sign: float, height: float) -> None:
        # Left of the curve R > 0, right of it R < 0; the chord's least is moved to where it nearly vanishes.
        shift = brentq(lambda x: self.least(x, sign) - height, -0.2, 0.2, xtol=1e-15)
        gait = self.chord(shift)
        check = gait.check()["R_sign"]
        assert check.decided
        assert check.ok is (height > 0)
        if check.ok:
            assert check.value == pytest.approx(sign * height, abs=1e-6)
            assert (">" if sign > 0 else "<") + " 0 along the whole gait" in check.message


def test_a_report_prints_every_check_and_what_is_beside_them() -> None:
    report = Report(
        checks=(
            Check(name="two_color", kind="valid", ok=True, message="all neighbours allowed"),
            Check(name="R_sign", kind="valid", ok=True, decided=False, message="undecided " * 14),
            Check(name="hover_thrust", kind="flyable", ok=False, message="a rotor pushes down"),
        ),
        reachable_from_hover=None,
        reachability="not decided here",
        notes=("row 3 is odd",),
    )
    assert str(report).splitlines() == [
        "valid yes · flyable no · reachable from hover unknown",
        "  ok  two color             all neighbours allowed",
        "  ??  R sign                undecided undecided undecided undecided undecided undecided undecided undecided",
        "                            undecided undecided undecided undecided undecided undecided",
        "  NO  hover thrust          a rotor pushes down",
        "  --  reachable from hover  not decided here",
        "warning: row 3 is odd",
    ]
    assert report.reason == "a rotor pushes down"
    assert report.warnings == ("undecided " * 14, "row 3 is odd")
    assert set(report.as_mapping()) == {"valid", "two_color", "flyable", "reachable_from_hover", "checks", "warnings"}
    with pytest.raises(KeyError, match="nothing"):
        report["nothing"]


def test_a_check_serialises_without_infinities() -> None:
    where = {"row": 3, "t": None, "fraction": 0.5, "alpha": [0.0] * 4}
    check = Check(name="x", kind="flyable", ok=False, message="m", value=np.inf, limit=np.nan, where=where)
    assert check.as_mapping() == {
        "name": "x",
        "kind": "flyable",
        "ok": False,
        "decided": True,
        "value": None,
        "limit": None,
        "where": where,
        "message": "m",
    }
    plain = Check(name="x", kind="valid", ok=True, message="m", value=np.float64(1.5), limit=2).as_mapping()
    assert (plain["value"], plain["limit"]) == (1.5, 2.0)
    assert type(plain["value"]) is float


def test_limits_of_rates_in_words() -> None:
    place = {"row": 1}
    free = limit_check("tilt_rate", "rad/s", 2.0, 3, None, place, "slower")
    assert (free.ok, free.value, free.limit, free.where) == (True, 2.0, None, place)
    assert free.message == "peak 2 rad/s (α3); the vehicle states no limit"
    kept = limit_check("tilt_rate", "rad/s", 2.0, 3, 2.0, place, "slower")
    assert (kept.ok, kept.limit, kept.message) == (True, 2.0, "peak 2 rad/s (α3), limit 2")
    assert limit_check("x", "u", 2.0 * (1 + 1e-13), 1, 2.0, None, "slower").ok
    broken = limit_check("tilt_rate", "rad/s", 2.1, 3, 2.0, place, "slower")
    assert (broken.ok, broken.kind, broken.name) == (False, "flyable", "tilt_rate")
    assert broken.message == "peak 2.1 rad/s (α3), limit 2: slower"
    endless = limit_check("tilt_acceleration", "rad/s²", np.inf, 1, 5.0, place, "corners")
    assert (endless.ok, endless.message) == (False, "corners (limit 5 rad/s²)")


def test_places_in_words() -> None:
    place = Place(point=56, fraction=0.25, alpha=(0.1, -0.2, 0.3, -1.0), t=0.5625)
    assert place.told("row") == "row 57 and 0.25 of the way to the next (t = 0.5625 s), (0.100, -0.200, 0.300, -1.000)"
    assert place.told("corner") == "(0.100, -0.200, 0.300, -1.000)"
    at_row = Place(point=0, fraction=0.0, alpha=(0.0,) * 4)
    assert at_row.told("row") == "row 1, (0.000, 0.000, 0.000, 0.000)"
    assert at_row.as_mapping("row") == {"row": 1, "t": None, "fraction": 0.0, "alpha": [0.0] * 4}
    assert place.as_mapping("corner") == {"segment": 56, "fraction": 0.25, "alpha": [0.1, -0.2, 0.3, -1.0]}


def test_a_gait_as_a_stretch_closes() -> None:
    stretch = stretch_of(lift([(0.4, -0.4), (0.8, -0.4), (0.8, -0.8)], ["red", "blue", "red"]))
    assert stretch.sheet.tolist() == [1, -1, 1, 1]
    assert stretch.sheet.dtype == np.int8
    np.testing.assert_array_equal(stretch.alpha[-1], stretch.alpha[0])
    assert [stretch.number(k) for k in range(4)] == [1, 2, 3, 1]
    assert stretch[1:].number(2) == 1
    assert stretch[1:3].number(1) == 3
    assert stretch_of(lift([(0.4, -0.4)], "red").biased(0.5)).sheet.tolist() == [0, 0]


def test_what_two_color_says_of_colors() -> None:
    red, blue = (lift([(0.9, -0.9), (1.0, -0.9)], color).check()["two_color"] for color in ("red", "blue"))
    assert red.message == "all neighbours allowed by Figure 15 (red)"
    assert blue.message == "all neighbours allowed by Figure 15 (blue)"
    assert (red.value, red.limit, red.kind) == (0.0, 0.0, "valid")
    mixed = lift([(np.pi / 16, -np.pi / 16), (np.pi / 8, -np.pi / 16)], ["blue", "red"]).check()["two_color"]
    assert mixed.message.endswith("(mixed)")
    broken = lift([(0.9, -0.9), (1.0, -0.9), (1.1, -0.9)], ["red", "red", "blue"]).check()["two_color"]
    assert (broken.value, broken.limit, broken.kind) == (1.0, 0.0, "valid")
    assert broken.where is not None
    assert broken.where["segment"] == 1
    assert broken.where["alpha"] == pytest.approx([1.0, -0.9, 1.0, -0.9])
    closing = lift([(np.pi / 16, -np.pi / 16), (0.9, -0.9), (1.1, -0.9)], ["blue", "red", "red"]).check()["two_color"]
    assert closing.ok
    seam = lift([(0.9, -0.9), (np.pi / 16, -np.pi / 16), (1.1, -0.9)], ["red", "red", "blue"]).check()["two_color"]
    assert "corners 3 (-,-) and 1 (+,+) may not be neighbours" in seam.message


LIMITED = gg.PAPER.replace(max_tilt="70deg", max_thrust=3.0, max_tilt_rate=10.0, max_tilt_acceleration=200.0)


def test_every_check_has_its_kind_and_its_limit() -> None:
    report = lift(GAITS[2].angles, "red", vehicle=LIMITED).parametrize().check(tolerance=1e-3, floor=0.07)
    assert [(check.name, check.kind, check.ok, check.decided) for check in report.checks] == [
        ("closed", "valid", True, True),
        ("on_surface", "valid", True, True),
        ("two_color", "valid", True, True),
        ("continuous", "valid", True, True),
        ("R_sign", "valid", True, True),
        ("least_singular_value", "flyable", True, True),
        ("hover_thrust", "flyable", True, True),
        ("thrust_limit", "flyable", True, True),
        ("tilt_range", "flyable", True, True),
        ("tilt_rate", "flyable", True, True),
        ("tilt_acceleration", "flyable", True, True),
    ]
    limits = [check.limit for check in report.checks if check.name != "R_sign"]
    assert limits == [0.0, 1e-3, 0.0, 1e-3, 0.07, 0.0, 3.0, pytest.approx(np.radians(70)), 10.0, 200.0]
    assert report["closed"].message == "closed by construction"
    assert report["on_surface"].message == "max(|Rφ|, |Rθ|) = 0, allowed 0.001"
    assert report["continuous"].message == "every segment stays on its sheet"
    assert report["thrust_limit"].message.startswith("largest hover thrust 2.75 N, limit 3 N")
    assert report["tilt_range"].message == "largest tilt 67.5°, limit 70.0°"
    assert report["tilt_range"].value == pytest.approx(3 * np.pi / 8)
    assert report["tilt_range"].where is not None
    assert report["tilt_range"].where["segment"] == 0
    for check in report.checks:
        assert type(check.ok) is bool


def test_broken_checks_say_what_where_and_what_helps() -> None:
    tight = gg.PAPER.replace(max_tilt="60deg", max_thrust=2.0)
    report = lift(GAITS[2].angles, "red", vehicle=tight).check(floor=0.5)
    at = "(1.178, -1.178, 1.178, -1.178)"
    assert report["tilt_range"].message == (
        f"largest tilt 67.5°, limit 60.0°, exceeded by α1 at {at}: move the waypoints nearer to 0"
    )
    assert report["thrust_limit"].message.endswith(f"N, limit 2 N, exceeded at {at}: tilt less there")
    assert report["least_singular_value"].message == (
        "the decoupling matrix is nearly singular: least singular value 0.45, floor 0.5, at "
        "(0.393, -0.393, 0.393, -0.393)"
    )
    assert (report["least_singular_value"].limit, report["least_singular_value"].kind) == (0.5, "flyable")
    biased = lift(GAITS[2].angles, "red").biased(0.5).check()
    surface = biased["on_surface"]
    assert (surface.kind, surface.limit, surface.ok) == ("valid", 2e-3, False)
    assert surface.message.startswith("max(|Rφ|, |Rθ|) = ")
    assert surface.message.endswith("): take (α3, α4) from the roots of (α1, α2), or allow more")
    follows = biased["continuous"]
    assert follows.message == "at corner 1 it is off the surfaces and follows no sheet"
    assert (follows.kind, follows.value, follows.limit) == ("valid", None, 2e-3)
    assert biased["two_color"].message == (
        "corner 1 lies off the surfaces, on neither sheet, so it has no color to compare: take (α3, α4) from the roots "
        "of (α1, α2)"
    )
    assert biased["two_color"].ok is False
    low = lift([(0.9, 0.9), (1.0, 0.9)], "red").check()["hover_thrust"]
    assert (low.kind, low.limit, low.ok) == ("flyable", 0.0, False)
    assert low.value is not None
    assert low.value < 0
    assert low.message.startswith(
        "a rotor pair would have to idle or push down to hover on the segment after corner 1:"
    )


def test_warnings_and_lines_beside_the_checks_are_wrapped() -> None:
    report = gg.validate(lift(GAITS[3].angles, "red"))
    lines = str(report).splitlines()
    assert (
        lines[-2] == "  ok  reachable from hover  in the component of α = 0, which ordinary hover can enter and leave"
    )
    assert lines[-1].startswith("  ok  colorings             1 with R > 0, all red")
    noted = str(replace(report, notes=("word " * 30,))).splitlines()
    assert noted[-2:] == ["warning: " + " ".join(["word"] * 20), "  " + " ".join(["word"] * 10)]
    assert max(len(line) for line in noted) <= 110


def test_gaits_are_judged_by_what_they_are_for() -> None:
    """Crossing tolerance and coefficients of the gait, rounding as told."""
    angles = [(np.pi / 16 + 0.05, -np.pi / 16), (np.pi / 8, -np.pi / 16)]
    for tolerance, ok in ((0.2, True), (0.01, False)):
        assert lift(angles, ["blue", "red"], crossing_tolerance=tolerance).check()["two_color"].ok is ok
    gait = lift(GAITS[2].angles, "red")
    sharp, blunt = gait.check(angle_rounding=1e-4)["R_sign"], gait.check(angle_rounding=1e-2)["R_sign"]
    assert sharp.limit is not None
    assert blunt.limit is not None
    assert sharp.limit < blunt.limit

"""Vehicles: how they are stated, and what is refused."""

from __future__ import annotations

import json
import math
import re
from dataclasses import FrozenInstanceError, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import FileProblem, InputError, MissingConstant
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.vehicle import PAPER, UNITS, Vehicle, vehicle_from_mapping, vehicle_named
from tests.samples import BOTH, LEANING, ODD, RAISED, STRONG, by_vehicle, cases

if TYPE_CHECKING:
    from pathlib import Path

RECTANGLE = [[0.2, 0.15, 0.0], [-0.2, 0.15, 0.0], [-0.2, -0.15, 0.0], [0.2, -0.15, 0.0]]
DRAGS = [0.01, 0.02, 0.01, 0.02]
PAIRED = ["clockwise", "clockwise", "counterclockwise", "counterclockwise"]
TILT_AXES = [[0.2, 0.15, 0.05], [-0.2, 0.1, 0.0], [-0.2, -0.15, 0.0], [2.0, -1.5, 0.3]]
KAPPA = 2.423e-7 / (8.048e-6 * 0.1785)


def rectangle(**stated: Any) -> Vehicle:
    constants = {"drag_to_thrust": 0.02, "rotor_positions": RECTANGLE}
    return Vehicle(**{**constants, **stated})


def refusal(message: str, make: Any, *args: Any, kind: Any = InputError) -> Any:
    """Return the error with which something is refused, which must fit the command line's one line."""
    with pytest.raises(kind, match=message) as caught:
        make(*args)
    assert "\n" not in str(caught.value)
    return caught.value


# -- Constants


def test_presets() -> None:
    assert PAPER.drag_ratio == pytest.approx(KAPPA, rel=1e-15)
    assert PAPER.signed_drag_ratio == PAPER.drag_ratio
    beetle = vehicle_named("beetle_omni")
    assert beetle.drag_ratio == pytest.approx(0.0165 / 0.2754, rel=1e-15)
    assert (beetle.mass, beetle.first_arm_angle) == (3.0386, math.pi / 4)
    assert beetle.signed_drag_ratio == -beetle.drag_ratio
    error = refusal(r"^vehicle must be a preset \(paper, ", vehicle_named, "papper")
    assert str(error).endswith("did you mean 'paper'?")
    assert "did you mean" not in str(refusal("preset", vehicle_named, "quadcopter"))
    for wrong in ([1], {1: 2}, None):
        refusal("^vehicle (must be a table|has no field)", vehicle_from_mapping, wrong)


@pytest.mark.parametrize(
    "stated",
    """
drag_to_thrust=0.05
drag_coefficient=4e-7, thrust_coefficient=8e-6
drag_coefficient=4e-7, thrust_coefficient=8e-6, drag_to_thrust=0.05
drag_ratio=0.2, thrust_coefficient=8e-6
drag_ratio=0.2 * (1 - 1e-13), drag_to_thrust=0.05 * (1 + 9e-7)
drag_to_thrust=[0.03, 0.04, 0.06, 0.07]
""".strip().splitlines(),
)
def test_every_way_to_state_the_drag_ratio(stated: str) -> None:
    vehicle = Vehicle(arm_length=0.25, **eval(f"dict({stated})"))
    assert vehicle.drag_ratio == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("ratio", [1e-9, 1e9])
def test_the_ends_of_the_range_of_drag_ratios(ratio: float) -> None:
    assert Vehicle(drag_ratio=ratio).drag_ratio == ratio


def test_published_coefficients_belong_to_the_paper_alone() -> None:
    same = PAPER.replace(name="same", mass=2.0, inertia=None, max_tilt=1.0)
    assert same.carries_published_coefficients
    others = [PAPER.replace(arm_length=0.18), PAPER.replace(first_arm_angle=0.1)]
    others += [PAPER.replace(first_rotor_spin="counterclockwise"), rectangle(), LEANING]
    for other in others:
        assert not other.carries_published_coefficients
        assert coefficients_of(other).kind == "exact"


NOT_POSITIVE: list[Any] = [
    0,
    0.0,
    -1.0,
    math.inf,
    math.nan,
    1e-31,
    1.0000001e30,
    1e-310,
]
NOT_POSITIVE += [True, np.True_, "heavy", b"0.1", 1j, [1.0], 10**5000]
OF_OTHER_KINDS = {"inertia", "rotor_height", "rotor_positions", "min_tilt"}
WRONG = dict.fromkeys(sorted(UNITS.keys() - OF_OTHER_KINDS), "*NOT_POSITIVE")
WRONG |= {
    "inertia": "(), (1, 2), [1] * 4, 1, '1 2 3', (1, 0, 1), (1, math.nan, 1), [True, 1, 1], [1, None, 1], ['1', 2, 3]",
    "first_arm_angle": "math.nan, 'north', None, True, [0.1]",
    "first_rotor_spin": "'cw', 'Clockwise', '', None, 1, ['clockwise']",
    "servo_feedback": "1, 0, 'yes', None, [True]",
    "name": "'', None, 3, ['a']",
    "rotor_height": "1.786, -1.786, math.nan, '5cm', None",
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_values_are_refused_with_name_and_value(name: str) -> None:
    for value in eval(f"[{WRONG[name]}]"):
        stated: dict[str, Any] = {"drag_ratio": 0.1, "arm_length": 0.1785, name: value}
        message = f"^(vehicle )?{name} must be .*, got "
        error = refusal(message, lambda s=stated: Vehicle(**s))
        assert len(str(error)) < 200


@pytest.mark.parametrize(
    ("stated", "message"),
    cases("""
name="a" | do not determine the drag ratio
arm_length=0.25 | do not determine the drag ratio
drag_coefficient=1, thrust_coefficient=1 | do not determine the drag
drag_ratio=0.2, drag_to_thrust=0.0501, arm_length=0.25 | must equal
drag_ratio=0.99e-9 | between 1e-9 and 1e9
drag_ratio=1.01e9 | between 1e-9 and 1e9
drag_ratio=0.1, drag_to_thrust=DRAGS | arm_length
drag_to_thrust=[0.0] * 4 | has no yaw torque at zero tilt
drag_ratio=0.1, rotor_height=0.1 | without an arm_length
"""),
)
def test_drag_ratios_that_are_open_or_contradicted(stated: str, message: str) -> None:
    refusal(message, lambda: Vehicle(**eval(f"dict({stated})")))


def test_a_rotor_height_is_at_most_ten_arm_lengths() -> None:
    low = PAPER.replace(rotor_height=np.float32(-1.785), arm_length=0.3)
    assert (low.height_ratio, PAPER.height_ratio) == (low.rotor_height / 0.3, 0.0)
    assert "rotor height" in str(low)
    flat = PAPER.replace(rotor_height=-0.0)
    assert (repr(flat), str(flat)) == (repr(PAPER), str(PAPER))


def test_angles_may_be_texts_and_other_constants_may_not() -> None:
    stated: dict[str, Any] = {"max_tilt": "80deg", "max_tilt_rate": "2pi"}
    vehicle = Vehicle(drag_ratio=0.1, first_arm_angle="-45°", **stated)
    angles = vehicle.max_tilt, vehicle.max_tilt_rate, vehicle.first_arm_angle
    assert angles == (math.radians(80), 2 * math.pi, -math.pi / 4)
    refusal("^max_tilt must be a positive", lambda: PAPER.replace(max_tilt="-80deg"))
    refusal(r"^mass must be .*, got '0\.4'", lambda: PAPER.replace(mass="0.4"))
    refusal("'max_tild'; did you mean 'max_tilt'", lambda: PAPER.replace(max_tild=1.0))


def test_numbers_of_any_kind_become_floats_and_the_record_cannot_change() -> None:
    parts: Any = [1, np.float32(2), np.int64(3)]
    vehicle = Vehicle(drag_ratio=1, mass=np.float64(2), inertia=parts)
    parts[0] = 9
    assert vehicle.inertia == (1.0, 2.0, 3.0)
    numbers = (vehicle.mass, vehicle.drag_ratio, *vehicle.inertia)
    assert {type(number) for number in numbers} == {float}
    with pytest.raises(FrozenInstanceError):
        vehicle.mass = 3.0  # type: ignore[misc]
    same = Vehicle(drag_ratio=1.0, mass=2.0, inertia=(1.0, 2.0, 3.0))
    assert hash(vehicle) == hash(same)


@pytest.mark.parametrize(
    ("mass", "arm_length", "warned"),
    [
        (2.0, 23, True),
        (2.0, 0.23, False),
        (120.0, 10.0, False),
        (None, 230, True),
    ],
)
def test_an_arm_that_is_hardly_in_metres_gets_a_warning(
    mass: float | None, arm_length: float, warned: bool
) -> None:
    vehicle = Vehicle(mass=mass, arm_length=arm_length, drag_to_thrust=0.017)
    report = lift([(0.4, -0.4)], "red", vehicle=vehicle).check()
    end = f"it is in metres; if this is in mm, write {arm_length / 1000:g}"
    for warnings in (vehicle.warnings, report.warnings):
        assert any(warning.endswith(end) for warning in warnings) is warned


def test_rotor_positions_in_millimetres_are_named_in_the_warning() -> None:
    places = 1000 * np.array(RECTANGLE)
    (line,) = rectangle(rotor_positions=places, drag_to_thrust=16).warnings
    assert line.startswith("rotor_positions = (200, 150, 0) of rotor 1: it is in")
    assert line.endswith("write (0.2, 0.15, 0)")


def test_a_constant_that_is_needed_and_not_stated_is_named_with_its_purpose() -> None:
    bare = Vehicle(name="bare", drag_ratio=0.1)
    for name in UNITS.keys() - {"drag_ratio", "gravity", "rotor_height"}:
        message = f"^vehicle 'bare' states no {name} .*, which a test needs$"
        with pytest.raises(MissingConstant, match=message) as caught:
            bare.require(name, purpose="a test")
        assert caught.value.field == f"vehicle.{name}"
    assert PAPER.require("arm_length", "mass", purpose="nothing") == (0.1785, 0.429)


# -- Files


GOOD = """mass = 1.5
arm_length = 0.25
drag_to_thrust = 0.05
max_tilt = '80deg'
inertia = [1, 2.0, 3e-3]
"""


def written(folder: Path, text: str | bytes, name: str = "mine.toml") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_constants_at_the_top_of_a_file_or_in_a_table(tmp_path: Path) -> None:
    vehicle = vehicle_named(written(tmp_path, GOOD))
    assert (vehicle.name, vehicle.mass, vehicle.inertia) == (
        "mine",
        1.5,
        (1.0, 2.0, 3e-3),
    )
    assert (vehicle.max_tilt, vehicle.drag_ratio) == (math.radians(80), 0.2)
    windows = b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()
    for text in ("[vehicle]\n" + GOOD, windows):
        assert vehicle_named(str(written(tmp_path, text))) == vehicle
    named = written(tmp_path, "name = 'Käfer'\n" + GOOD, "OTHER.TOML")
    assert vehicle_named(named) == vehicle.replace(name="Käfer")


@pytest.mark.parametrize("reports", [True, False])
def test_servos_that_report_their_angles(reports: bool) -> None:
    vehicle = PAPER.replace(servo_feedback=reports)
    assert ("servo_feedback" in vehicle.as_mapping()) is reports
    assert ("servo feedback      yes" in str(vehicle)) is reports


def test_a_preset_may_be_changed_but_not_under_its_name(tmp_path: Path) -> None:
    assert vehicle_named(written(tmp_path, "preset = 'paper'\n")) == PAPER
    changed = vehicle_named(written(tmp_path, "preset = 'paper'\narm_length = 0.357\n"))
    assert changed == PAPER.replace(name="paper, changed", arm_length=0.357)
    heavy = vehicle_named(written(tmp_path, "preset = 'paper'\nname = 'heavy'\n"))
    assert heavy.name == "heavy"
    for name in ("arm_length", "first_arm_angle", "rotor_height"):
        constants = {"preset": "beetle_art", name: 0.1}
        message = f"{name} must be omitted beside the preset 'beetle_art'"
        refusal(message, vehicle_from_mapping, constants)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max_tilt = '3pie/8'\ndrag_ratio = 0.1\n", "max_tilt must be a finite number"),
        ("mas = 1.5\ndrag_ratio = 0.1\n", "'mas'; did you mean 'mass'?"),
        ("zzz = 1\ndrag_ratio = 0.1\n", "'zzz'; the fields are preset, name, mass"),
        ("[[vehicle]]\ndrag_ratio = 0.1\n", "vehicle must be a table of values by"),
        ("mas = 3\n[vehicle]\npreset = 'paper'", "mas must be inside the [vehicle]"),
        ("drag_ratio = " + "1" * 5000, ""),
    ],
)
def test_what_else_is_in_a_file_is_refused_with_the_file(
    tmp_path: Path, text: str, message: str
) -> None:
    path = written(tmp_path, text)
    start = f"^vehicle (file )?{re.escape(repr(str(path)))}"
    error = refusal(start, vehicle_named, path)
    assert message in str(error)
    assert len(str(error)) < len(str(path)) + 600


def test_a_file_that_cannot_be_read_is_named_with_the_reason(tmp_path: Path) -> None:
    folder = tmp_path / "folder.toml"
    folder.mkdir()
    for path in (tmp_path / "missing.toml", folder, "a\0.toml"):
        refusal("cannot be read", vehicle_named, path, kind=FileProblem)


# -- Changes


@pytest.mark.parametrize(
    ("stated", "factor"),
    cases("""
drag_coefficient=2 * 2.423e-7 | 2
thrust_coefficient=2 * 8.048e-6 | 1 / 2
arm_length=2 * 0.1785 | 1 / 2
arm_length=2 * 0.1785, drag_coefficient=4 * 2.423e-7 | 2
drag_to_thrust=2 * 2.423e-7 / 8.048e-6 | 2
drag_ratio=3 * KAPPA | 3
mass=2.0, gravity=1.62, max_tilt=1.0, name="Käfer (κ)" | 1
rotor_height=-0.03, rotor_lag=0.02, max_thrust=0.1 + 0.2 | 1
"""),
)
def test_what_was_derived_is_derived_anew(stated: str, factor: str) -> None:
    changes = eval(f"dict({stated})")
    changed = PAPER.replace(**changes)
    assert changed.drag_ratio == pytest.approx(eval(factor) * KAPPA, rel=1e-12)
    for name, value in changes.items():
        assert getattr(changed, name) == value


def test_a_stated_kappa_survives_changes_that_do_not_touch_it() -> None:
    assert Vehicle(drag_ratio=0.1).replace(arm_length=0.3).drag_ratio == 0.1
    partial = Vehicle(drag_ratio=0.1, arm_length=0.25)
    whole = partial.replace(thrust_coefficient=8e-6, drag_coefficient=4e-7)
    assert whole.drag_ratio == pytest.approx(0.2)
    beetle = vehicle_named("beetle_omni").replace(thrust_coefficient=1e-5)
    assert beetle.drag_to_thrust == vehicle_named("beetle_omni").drag_to_thrust


@by_vehicle(PAPER, BOTH, STRONG, RAISED, LEANING, rectangle(drag_to_thrust=DRAGS))
def test_a_vehicle_is_kept_by_its_mapping_its_file_and_its_changes(
    vehicle: Vehicle, tmp_path: Path
) -> None:
    """No stale constant contradicts the others; a fixed order makes files of the same content the same bytes."""
    stated = vehicle.as_mapping()
    assert vehicle_from_mapping(json.loads(json.dumps(stated))) == vehicle
    assert [*stated] == [f.name for f in fields(Vehicle) if f.name in stated]
    lines = [f"{name} = {json.dumps(value)}" for name, value in stated.items()]
    assert vehicle_named(written(tmp_path, "\n".join(lines))) == vehicle
    assert vehicle.replace(mass=2.0).replace(mass=vehicle.mass) == vehicle
    for name in stated.keys() - {"name"}:
        assert name.replace("_", " ") in str(vehicle)


# -- Positions


def test_what_equal_arms_state_follows_from_positions() -> None:
    vehicle = rectangle(drag_to_thrust=DRAGS)
    assert math.isclose(vehicle.arm_length or 0, 0.25)
    assert math.isclose(vehicle.drag_ratio, 0.06)
    assert np.allclose(vehicle.scaled_drags, 4 * np.array(DRAGS))
    assert np.allclose(vehicle.scaled_positions, 4 * np.array(RECTANGLE))
    assert np.allclose(vehicle.arm_angles, np.arctan2(*np.array(RECTANGLE).T[1::-1]))
    assert vehicle.asymmetry is None
    assert not vehicle.has_raised_rotors
    assert ODD.has_raised_rotors
    for name in ("arm_length", "first_arm_angle", "rotor_height"):
        change = {name: 0.3}
        refusal(f"{name} must be omitted beside", lambda c=change: vehicle.replace(**c))
    assert vehicle.replace(rotor_positions=None, arm_length=0.3).arm_length == 0.3


def test_equal_arms_are_the_same_vehicle_in_both_ways() -> None:
    arms = PAPER.replace(rotor_height=0.01, first_arm_angle=0.3)
    angles = 0.3 + np.arange(4) * math.pi / 2
    circle = 0.1785 * np.column_stack([np.cos(angles), np.sin(angles)])
    places = np.column_stack([circle, np.full(4, 0.01)])
    again = PAPER.replace(rotor_positions=places)
    assert again.rotor_positions is None
    # To 1e-9 of the arm length.
    places[0, 2] += 1e-9 * 0.3
    assert PAPER.replace(rotor_positions=places).rotor_positions is not None
    places[0, 2] -= 1e-9 * 0.2
    assert PAPER.replace(rotor_positions=places).rotor_positions is None
    assert np.allclose(arms.scaled_positions, places / 0.1785)
    assert np.allclose(arms.arm_angles, angles)
    for name in ("arm_length", "first_arm_angle", "rotor_height", "drag_ratio"):
        assert math.isclose(getattr(again, name), getattr(arms, name))
    assert PAPER.spin_signs == (-1, 1, -1, 1)
    assert BOTH.spin_signs == (1, -1, 1, -1)


@pytest.mark.parametrize(
    ("rotor", "place", "reason"),
    [
        (1, [-0.2, 0.16, 0.0], r"rotors 2 and 4 at \(-0\.2, 0\.16, 0\)"),
        (2, [-0.2, -0.15, 0.1], "rotors 1 and 3 at"),
    ],
)
def test_the_pair_that_is_not_symmetric_is_named(
    rotor: int, place: list[float], reason: str
) -> None:
    places = [*RECTANGLE]
    places[rotor] = place
    assert re.search(reason, str(rectangle(rotor_positions=places).asymmetry))
    unequal = rectangle(drag_to_thrust=[0.01, 0.02, 0.01, 0.03]).asymmetry
    assert unequal == "rotors 2 and 4 with a drag_to_thrust of 0.02 and 0.03 m"


@pytest.mark.parametrize(
    "places",
    """
"x"
[[1, 0, 0]]
RECTANGLE[::-1]
[*RECTANGLE[:3], [0, 0, 0.1]]
[[0.2, 0.15, math.nan], *RECTANGLE[1:]]
[[0.2, 0.15, 30.0], *RECTANGLE[1:]]
""".strip().splitlines(),
)
def test_what_is_not_four_places_around_body_z_is_refused(places: str) -> None:
    make = lambda: rectangle(rotor_positions=eval(places))  # noqa: E731 - called below
    error = refusal("rotor_positions must be", make)
    assert error.field == "rotor_positions"


def test_a_rotor_in_the_centre_is_named() -> None:
    places = [*RECTANGLE[:3], [0, 0, 0.1]]
    refusal("rotor 4", lambda: rectangle(rotor_positions=places))


@pytest.mark.parametrize(
    "constants",
    [
        {"arm_length": [0.2, 0.2, 0.3, 0.3]},
        {"first_arm_angle": ("45deg", "135deg", "225deg", "315deg")},
        {"arm_angles": [0, 1, 2, 4]},
    ],
)
def test_arms_that_differ_are_told_how_to_state_them(constants: Any) -> None:
    (name,) = constants
    message = rf"stated as rotor_positions \(m\), got {name} = "
    for make in (
        lambda: PAPER.replace(**constants),
        lambda: vehicle_named({"preset": "padova", **constants}),
    ):
        field = refusal(message, make).field
        assert field is not None
        assert field.removeprefix("vehicle.") == name


# -- Axes and spins


@pytest.mark.parametrize(
    "stated",
    [
        {"tilt_axes": [[x, y, 0.0] for x, y, _ in RECTANGLE]},
        {"thrust_axes": [[0.0, 0.0, 2.0]] * 4},
        {"thrust_axes": [[x, y, 0.3] for x, y, _ in RECTANGLE]},
        {"spins": ["clockwise", "counterclockwise"] * 2},
    ],
)
def test_default_axes_and_spins_are_the_same_vehicle(stated: Any) -> None:
    assert repr(rectangle(**stated)) == repr(rectangle())
    unequal = np.array(RECTANGLE) * [[1.0], [2.0], [1.0], [2.0]]
    shown = repr(rectangle(rotor_positions=unequal, **stated))
    assert shown == repr(rectangle(rotor_positions=unequal))


def test_axes_are_unit_vectors_that_are_perpendicular() -> None:
    thrust = np.array([[0.1, 0.0, 1.0], [0, 0, 5], [0, -1, 1], [0, 0.2, -3]])
    vehicle = PAPER.replace(tilt_axes=TILT_AXES, thrust_axes=thrust)
    tilt, across = vehicle.axes
    assert np.allclose(np.linalg.norm([tilt, across], axis=2), 1.0)
    assert np.abs(np.sum(tilt * across, axis=1)).max() < 1e-15
    assert np.abs(np.cross(tilt, TILT_AXES)).max() < 1e-15
    assert np.abs(np.linalg.det(np.stack([tilt, across, thrust], 1))).max() < 1e-15
    assert (np.sum(across * thrust, axis=1) > 0).all()
    assert vehicle.asymmetry is not None


@pytest.mark.parametrize(
    ("stated", "message"),
    cases("""
tilt_axes=[[0, 0, 0], *TILT_AXES[1:]] | rotor 1, which then cannot tilt
thrust_axes=[*TILT_AXES[1:], [0] * 3] | rotor 4, which then cannot thrust
tilt_axes=TILT_AXES[:3] | tilt_axes must be four directions
tilt_axes=[*TILT_AXES[:3], [0, 0, 1]] | tilt_axes must .* for rotor 4
thrust_axes=RECTANGLE | thrust_axes must be .* for rotor 1
tilt_axes=[[0, 0, 1]] * 4, thrust_axes=RECTANGLE | vehicle must lift
spins=PAIRED[:3] | spins must be four words
spins=["left", *PAIRED[1:]] | spins must be one of
first_rotor_spin="counterclockwise", spins=PAIRED | first_rotor_spin must be omitted
"""),
)
def test_what_the_vehicle_cannot_do_is_said(stated: str, message: str) -> None:
    error = refusal(message, lambda: rectangle(**eval(f"dict({stated})")))
    assert error.field == "vehicle" or f"{error.field}=" in stated


@pytest.mark.parametrize(
    ("shift", "message"),
    [(0.0, r"none about \(-?0, -?0, -?1\)"), (0.01, "without the others")],
)
def test_rotors_without_a_moment_about_an_axis_are_refused(
    shift: float, message: str
) -> None:
    """Tangential tilt axes that lean so that drag and lever cancel: the yaw torque is a multiple of the lift."""
    axes = np.cross([0.0, 0.0, 1.0], RECTANGLE)
    axes[:, 2] += np.array([1, -1, 1, -1]) * 0.02 + shift  # with the sign of the spin
    refusal(message, lambda: rectangle(tilt_axes=axes))
    axes[0, 2] += 0.001
    rectangle(tilt_axes=axes)


def test_vehicles_shows_both_crossing_lines_where_they_differ(
    run: Any, tmp_path: Path
) -> None:
    text = "arm_length = 0.25\ndrag_to_thrust = [0.016, 0.02, 0.016, 0.02]\n"
    file = written(tmp_path, text)
    first, second = coefficients_of(vehicle_named(file)).crossings
    line = f"planes cross at α1 = {first:.6f} rad and α2 = {second:.6f} rad"
    assert line in run("vehicles", file).out
    shown = run("vehicles", file, "--json").json["vehicles"][0]
    assert (shown["delta"], shown["crossings"]) == (first, [first, second])
    assert "δ = " in run("vehicles", "beetle_omni").out

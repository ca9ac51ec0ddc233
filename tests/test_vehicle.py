"""Vehicles: how they are stated, and what is refused."""

from __future__ import annotations

import json
import math
import re
from dataclasses import FrozenInstanceError, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import FileProblem, GaitgraphError, InputError, MissingConstant
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.vehicle import PAPER, UNITS, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

POSITIVE = [
    name
    for name in UNITS
    if name not in ("inertia", "rotor_height", "rotor_positions", "min_tilt")
]
NO_CONSTANTS: tuple[object, ...] = (
    *(0, 0.0, -1.0, math.inf, math.nan, 1e-31, 1.0000001e30),
    *(True, np.True_, "heavy", b"0.1", 1j, [1.0], 10**5000, 1e-310),
)


def written(folder: Path, text: str | bytes, name: str = "mine.toml") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def refusal(path: Path | str, kind: type[Exception] = InputError) -> str:
    """Return the message with which a vehicle file is refused, which must fit the command line's one line."""
    with pytest.raises(kind) as caught:
        vehicle_named(path)
    message = str(caught.value)
    assert isinstance(caught.value, GaitgraphError)
    assert "\n" not in message
    return message


def test_presets() -> None:
    assert PAPER.drag_ratio == pytest.approx(2.423e-7 / (8.048e-6 * 0.1785), rel=1e-15)
    assert PAPER.signed_drag_ratio == PAPER.drag_ratio
    beetle = vehicle_named("beetle_omni")
    assert beetle.drag_ratio == pytest.approx(0.0165 / 0.2754, rel=1e-15)
    assert (beetle.mass, beetle.first_arm_angle) == (3.0386, math.pi / 4)
    assert beetle.signed_drag_ratio == -beetle.drag_ratio
    assert not beetle.carries_published_coefficients
    message = refusal("papper")
    assert message.startswith(
        "vehicle must be a preset (paper, beetle_omni, beetle_art, gimbalrotor, padova), a "
    )
    assert message.endswith("did you mean 'paper'?")
    assert "did you mean" not in refusal("quadcopter")
    for wrong in ([1], {1: 2}, None):
        with pytest.raises(
            InputError, match="vehicle (must be a table of values by name|has no field)"
        ):
            vehicle_from_mapping(wrong)  # type: ignore[arg-type]


class TestDragRatio:
    @pytest.mark.parametrize(
        "stated",
        [
            {"drag_to_thrust": 0.05, "arm_length": 0.25},
            {"drag_coefficient": 4e-7, "thrust_coefficient": 8e-6, "arm_length": 0.25},
            {
                "drag_coefficient": 4e-7,
                "thrust_coefficient": 8e-6,
                "arm_length": 0.25,
                "drag_to_thrust": 0.05,
            },
            {"drag_ratio": 0.2, "arm_length": 0.25, "thrust_coefficient": 8e-6},
            {
                "drag_ratio": 0.2 * (1 - 1e-13),
                "drag_to_thrust": 0.05 * (1 + 9e-7),
                "arm_length": 0.25,
            },
        ],
        ids="+".join,
    )
    def test_every_way_to_state_it(self, stated: dict[str, Any]) -> None:
        assert Vehicle(**stated).drag_ratio == pytest.approx(0.2, rel=1e-12)

    @pytest.mark.parametrize(
        "stated",
        ["", "thrust_coefficient", "arm_length", "drag_coefficient thrust_coefficient"],
    )
    def test_too_little_is_refused_with_all_statements_that_are_enough(
        self, stated: str
    ) -> None:
        with pytest.raises(
            InputError, match="do not determine the drag ratio"
        ) as caught:
            Vehicle(**dict.fromkeys(stated.split(), 0.25))
        for name in (
            "drag_coefficient",
            "thrust_coefficient",
            "arm_length",
            "drag_to_thrust",
            "drag_ratio",
        ):
            assert name in str(caught.value)

    def test_the_ends_of_its_range(self) -> None:
        assert [Vehicle(drag_ratio=kappa).drag_ratio for kappa in (1e-9, 1e9)] == [
            1e-9,
            1e9,
        ]

    def test_published_coefficients_belong_to_the_paper_alone(self) -> None:
        assert PAPER.replace(
            name="same", mass=2.0, inertia=None, max_tilt=1.0
        ).carries_published_coefficients
        for other in (
            PAPER.replace(arm_length=0.18),
            PAPER.replace(first_rotor_spin="counterclockwise"),
            PAPER.replace(first_arm_angle=0.1),
        ):
            assert not other.carries_published_coefficients
            assert coefficients_of(other).kind == "exact"
        assert not Vehicle(drag_ratio=0.168666).carries_published_coefficients


class TestFields:
    def test_wrong_values_are_refused_with_name_and_value(self) -> None:
        wrong: list[tuple[str, tuple[object, ...]]] = [
            *((name, NO_CONSTANTS) for name in POSITIVE),
            (
                "inertia",
                (
                    (),
                    (1.0, 2.0),
                    (1.0, 2.0, 3.0, 4.0),
                    1.0,
                    "1 2 3",
                    (1.0, 0.0, 1.0),
                    (1.0, math.nan, 1.0),
                ),
            ),
            (
                "inertia",
                (
                    [True, 1.0, 1.0],
                    [1.0, None, 1.0],
                    [[1.0], 1.0, 1.0],
                    ["1", "2", "3"],
                ),
            ),
            ("first_arm_angle", (math.nan, "north", None, True, [0.1])),
            ("first_rotor_spin", ("cw", "Clockwise", "", None, 1, ["clockwise"])),
            ("servo_feedback", (1, 0, "yes", None, [True])),
            ("name", ("", None, 3, ["a"])),
        ]
        for name, value in (
            (name, value) for name, values in wrong for value in values
        ):
            stated: dict[str, Any] = {"drag_ratio": 0.1, name: value}
            with pytest.raises(
                InputError, match=rf"^(vehicle )?{name} must be .*, got "
            ) as caught:
                Vehicle(**stated)
            assert "\n" not in str(caught.value)
            assert len(str(caught.value)) < 200

    def test_a_rotor_height_is_at_most_ten_arm_lengths(self) -> None:
        low = PAPER.replace(rotor_height=np.float32(-1.785), arm_length=0.3)
        assert (low.height_ratio, PAPER.height_ratio) == (low.rotor_height / 0.3, 0.0)
        assert ["rotor height" in line for line in str(low).splitlines()].count(
            True
        ) == 1
        assert vehicle_from_mapping(low.as_mapping()) == low
        for flat in (
            PAPER,
            PAPER.replace(rotor_height=-0.0),
            low.replace(rotor_height=0.0, arm_length=0.1785),
        ):
            assert (
                flat == PAPER
            )  # and its constants are printed as if there were no such field
            assert (str(flat), repr(flat), math.copysign(1.0, flat.rotor_height)) == (
                str(PAPER),
                repr(PAPER),
                1.0,
            )
            assert "rotor height" not in str(flat)
        for stated, message in (
            (
                {"rotor_height": 1.786},
                r"rotor_height must be within ±1\.785 m, ten arm lengths, got 1\.786$",
            ),
            (
                {"rotor_height": -0.5, "arm_length": 0.04},
                r"within ±0\.4 m, ten arm lengths, got -0\.5$",
            ),
            ({"rotor_height": math.nan}, "rotor_height must be within .*, got nan$"),
            ({"rotor_height": "5cm"}, "rotor_height must be within .*, got '5cm'$"),
            ({"rotor_height": None}, "rotor_height must be within .*, got None$"),
        ):
            with pytest.raises(InputError, match=message):
                PAPER.replace(**stated)
        with pytest.raises(
            InputError,
            match="^rotor_height must be 0 m without an arm_length, got 0.1; state arm_len",
        ):
            Vehicle(drag_ratio=0.1, rotor_height=0.1)
        assert Vehicle(drag_ratio=0.1, rotor_height=0).rotor_height == 0.0

    def test_angles_may_be_texts_and_other_constants_may_not(self) -> None:
        stated: dict[str, Any] = {
            "max_tilt": "80deg",
            "max_tilt_rate": "2pi",
            "first_arm_angle": "-45°",
        }
        vehicle = Vehicle(drag_ratio=0.1, **stated)
        assert vehicle.max_tilt == math.radians(80)
        assert vehicle.max_tilt_rate == 2 * math.pi
        assert vehicle.first_arm_angle == -math.pi / 4
        with pytest.raises(
            InputError, match=r"^max_tilt must be a positive .*, got '-80deg'"
        ):
            Vehicle(drag_ratio=0.1, max_tilt="-80deg")
        with pytest.raises(InputError, match=r"^mass must be .*, got '0\.4'"):
            PAPER.replace(mass="0.4")
        with pytest.raises(
            InputError, match="vehicle has no field 'max_tild'; did you mean 'max_tilt'"
        ):
            PAPER.replace(max_tild=1.0)

    def test_numbers_of_any_kind_become_floats_and_the_record_cannot_change(
        self,
    ) -> None:
        parts: Any = [1, np.float32(2), np.int64(3)]
        vehicle = Vehicle(drag_ratio=1, mass=np.float64(2), inertia=parts)
        assert vehicle.inertia == (1.0, 2.0, 3.0)
        assert all(
            type(part) is float
            for part in (vehicle.mass, vehicle.drag_ratio, *vehicle.inertia)
        )
        parts[0] = 9
        assert vehicle.inertia[0] == 1.0
        with pytest.raises(FrozenInstanceError):
            vehicle.mass = 3.0  # type: ignore[misc]
        assert hash(vehicle) == hash(
            Vehicle(drag_ratio=1.0, mass=2.0, inertia=(1.0, 2.0, 3.0))
        )


@pytest.mark.parametrize(
    ("mass", "arm_length", "told"),
    [
        (2.0, 230, True),
        (2.0, 23, True),
        (2.0, 0.23, False),
        (120.0, 10.0, False),
        (None, 230, True),
        (None, 0.23, False),
    ],
)
def test_an_arm_that_is_hardly_in_metres_gets_a_warning(
    mass: float | None, arm_length: float, told: bool, run: Any, tmp_path: Path
) -> None:
    constants = {"arm_length": arm_length, "drag_to_thrust": 0.017}
    if mass is not None:
        constants["mass"] = mass
    file = tmp_path / "mine.toml"
    file.write_text("".join(f"{name} = {value}\n" for name, value in constants.items()))
    vehicle = Vehicle(**constants)
    words = f"arm_length = {arm_length:g}" + " with a mass of 2 kg" * (mass == 2.0)
    line = f"{words}: it is in metres; if this is in mm, write {arm_length / 1000:g}"
    assert (line in vehicle.warnings) is told
    assert (line in run("vehicles", file).err) is told
    report = lift([(0.4, -0.4)], "red", vehicle=vehicle).check()
    assert (line in report.warnings) is told
    assert "metres" not in report.reachability


def test_a_constant_that_is_needed_and_not_stated_is_named_with_its_purpose() -> None:
    for name in set(UNITS) - {"drag_ratio", "gravity", "rotor_height"}:
        with pytest.raises(
            MissingConstant,
            match=f"^vehicle 'bare' states no {name} .*, which a test needs$",
        ):
            Vehicle(name="bare", drag_ratio=0.1).require(name, purpose="a test")
    assert PAPER.require("arm_length", "mass", purpose="nothing") == (0.1785, 0.429)


class TestFiles:
    GOOD = "mass = 1.5\narm_length = 0.25\ndrag_to_thrust = 0.05\nmax_tilt = '80deg'\ninertia = [1, 2.0, 3e-3]\n"

    def test_constants_at_the_top_or_in_a_table(self, tmp_path: Path) -> None:
        vehicle = vehicle_named(written(tmp_path, self.GOOD))
        assert (vehicle.name, vehicle.mass, vehicle.inertia) == (
            "mine",
            1.5,
            (1.0, 2.0, 3e-3),
        )
        assert vehicle.max_tilt == math.radians(80)
        assert vehicle.drag_ratio == pytest.approx(0.2)
        assert vehicle_named(written(tmp_path, "[vehicle]\n" + self.GOOD)) == vehicle
        assert vehicle_named(str(tmp_path / "mine.toml")) == vehicle
        # A byte-order mark and CRLF are read silently; the file may give the name, and the suffix have any case.
        assert (
            vehicle_named(
                written(
                    tmp_path, b"\xef\xbb\xbf" + self.GOOD.replace("\n", "\r\n").encode()
                )
            )
            == vehicle
        )
        named = written(tmp_path, "name = 'Käfer'\n" + self.GOOD, "OTHER.TOML")
        assert vehicle_named(str(named)) == vehicle.replace(name="Käfer")

    @pytest.mark.parametrize("reports", [True, False])
    def test_servos_that_report_their_angles(
        self, reports: bool, tmp_path: Path
    ) -> None:
        stated = f"servo_feedback = {str(reports).lower()}\n"
        vehicle = vehicle_named(written(tmp_path, self.GOOD + stated))
        assert vehicle.servo_feedback is reports
        assert ("servo_feedback" in vehicle.as_mapping()) is reports
        assert ("servo feedback    yes" in str(vehicle)) is reports
        assert vehicle_from_mapping(vehicle.as_mapping()) == vehicle
        assert vehicle.replace(mass=2.0).servo_feedback is reports
        assert not PAPER.servo_feedback
        assert vehicle_named("beetle_omni").servo_feedback

    def test_a_preset_may_be_changed(self, tmp_path: Path) -> None:
        assert vehicle_named(written(tmp_path, "preset = 'paper'\n")) == PAPER
        changed = vehicle_named(
            written(
                tmp_path, "preset = 'paper'\nmax_tilt_rate = 6\narm_length = 0.357\n"
            )
        )
        # What was changed must not go by the preset's name.
        assert changed == PAPER.replace(
            name="paper, changed", max_tilt_rate=6.0, arm_length=0.357
        )
        assert (
            vehicle_named(written(tmp_path, "preset = 'paper'\nname = 'heavy'\n")).name
            == "heavy"
        )

    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            (
                "max_tilt = '3pie/8'\ndrag_ratio = 0.1\n",
                "max_tilt must be a finite number in radians",
            ),
            (
                "mas = 1.5\ndrag_ratio = 0.1\n",
                "vehicle has no field 'mas'; did you mean 'mass'?",
            ),
            (
                "zzz = 1\ndrag_ratio = 0.1\n",
                "vehicle has no field 'zzz'; the fields are preset, name, mass",
            ),
            (
                "arm_angles = [0, 1, 2, 4]\ndrag_ratio = 0.1\n",
                "arms must be equal and a quarter turn apart",
            ),
            ("vehicle = 3\n", "vehicle must be a table of values by name, got 3"),
            (
                "[[vehicle]]\ndrag_ratio = 0.1\n",
                "vehicle must be a table of values by name, got [",
            ),
            ("mass = \n", "line 1"),
            ("a = " + "[" * 50_000, "vehicle file"),
            ("drag_ratio = " + "1" * 5000, "vehicle file"),
            (
                "mas = 3\n[vehicle]\npreset = 'paper'",
                "mas must be inside the [vehicle] table",
            ),
        ],
    )
    def test_what_else_is_in_a_file_is_refused_with_the_file(
        self, tmp_path: Path, text: str, expected: str
    ) -> None:
        path = written(tmp_path, text)
        message = refusal(path)
        assert message.startswith(f"vehicle file {str(path)!r}: ")
        assert expected in message
        assert len(message) < len(str(path)) + 600

    @pytest.mark.parametrize(
        "constants",
        [
            {"arm_length": [0.2, 0.2, 0.3, 0.3]},
            {"first_arm_angle": ("45deg", "135deg", "225deg", "315deg")},
            {"arm_angles": [0, 1, 2, 4]},
        ],
    )
    def test_arms_that_differ_are_told_how_to_state_them(
        self, constants: dict[str, Any]
    ) -> None:
        (name,) = constants
        ways: list[Callable[[], Vehicle]] = [
            lambda: Vehicle(drag_ratio=0.1, **constants),
            lambda: PAPER.replace(**constants),
            lambda: vehicle_named({"preset": "padova", **constants}),
        ]
        for make in ways:
            with pytest.raises(
                InputError, match=rf"stated as rotor_positions \(m\), got {name} = "
            ) as caught:
                make()
            assert caught.value.field == name

    def test_a_file_that_cannot_be_read_is_named_with_the_reason(
        self, tmp_path: Path
    ) -> None:
        missing, folder = tmp_path / "missing.toml", tmp_path / "folder.toml"
        folder.mkdir()
        assert refusal(missing, FileProblem).startswith(
            f"vehicle {str(missing)!r} cannot be read: No such file"
        )
        assert str(folder) in refusal(str(folder), FileProblem)
        assert "cannot be read" in refusal("a\0.toml", FileProblem)
        for content in (b"name = '\xff\xfe'\n", "drag_ratio = 0.1".encode("utf-16")):
            assert "must be UTF-8 text" in refusal(written(tmp_path, content))


class TestReplace:
    @pytest.mark.parametrize(
        ("changes", "factor"),
        [
            ({"drag_coefficient": 2 * 2.423e-7}, 2.0),
            ({"thrust_coefficient": 2 * 8.048e-6}, 0.5),
            ({"arm_length": 2 * 0.1785}, 0.5),
            ({"arm_length": 2 * 0.1785, "drag_coefficient": 4 * 2.423e-7}, 2.0),
            ({"drag_to_thrust": 2 * 2.423e-7 / 8.048e-6}, 2.0),
            ({"drag_ratio": 3 * 2.423e-7 / (8.048e-6 * 0.1785)}, 3.0),
            ({"mass": 2.0, "gravity": 1.62, "max_tilt": 1.0}, 1.0),
            ({"rotor_height": -0.03, "rotor_lag": 0.02}, 1.0),
            (
                {
                    "name": "Käfer (κ)",
                    "max_thrust": 0.1 + 0.2,
                    "servo_lag": 1e-3,
                    "rotor_inertia": 1e-5,
                },
                1.0,
            ),
        ],
    )
    def test_what_was_derived_is_derived_anew(
        self, changes: dict[str, Any], factor: float
    ) -> None:
        changed = PAPER.replace(**changes)
        assert changed.drag_ratio == pytest.approx(factor * PAPER.drag_ratio, rel=1e-12)
        for name, value in changes.items():
            assert getattr(changed, name) == value
        assert changed.first_arm_angle == PAPER.first_arm_angle
        assert changed.inertia == PAPER.inertia
        # No stale constant may contradict the new ones; a fixed order makes files of the same content the same bytes.
        constants = changed.as_mapping()
        assert vehicle_from_mapping(json.loads(json.dumps(constants))) == changed
        assert list(constants) == [
            field.name for field in fields(Vehicle) if field.name in constants
        ]

    def test_a_stated_kappa_survives_changes_that_do_not_touch_it(self) -> None:
        assert Vehicle(drag_ratio=0.1).replace(arm_length=0.3).drag_ratio == 0.1
        both = Vehicle(drag_ratio=0.1, arm_length=0.25).replace(
            thrust_coefficient=8e-6, drag_coefficient=4e-7
        )
        assert both.drag_ratio == pytest.approx(0.2)
        beetle = vehicle_named("beetle_omni")
        complete = vehicle_from_mapping(
            {"preset": "beetle_omni", "name": "beetle_omni", "thrust_coefficient": 1e-5}
        )
        assert complete == beetle.replace(thrust_coefficient=1e-5)
        assert (complete.drag_ratio, complete.drag_to_thrust) == (
            beetle.drag_ratio,
            beetle.drag_to_thrust,
        )


RECTANGLE = [[0.2, 0.15, 0.0], [-0.2, 0.15, 0.0], [-0.2, -0.15, 0.0], [0.2, -0.15, 0.0]]


class TestPositions:
    """Four rotors by their places."""

    def test_what_equal_arms_state_follows_from_them(self) -> None:
        vehicle = Vehicle(drag_to_thrust=0.02, rotor_positions=RECTANGLE)
        assert math.isclose(vehicle.arm_length or 0, 0.25)
        assert math.isclose(vehicle.drag_ratio, 0.08)
        assert np.allclose(
            vehicle.arm_angles, np.arctan2(*np.array(RECTANGLE).T[1::-1])
        )
        assert np.allclose(vehicle.scaled_positions, 4 * np.array(RECTANGLE))
        assert vehicle.asymmetry is None
        assert not vehicle.has_raised_rotors
        assert not vehicle.carries_published_coefficients

    def test_each_rotor_may_have_a_drag(self) -> None:
        drags = [0.01, 0.02, 0.01, 0.02]
        vehicle = Vehicle(drag_to_thrust=drags, rotor_positions=RECTANGLE)
        assert np.allclose(vehicle.scaled_drags, 4 * np.array(drags))
        assert math.isclose(vehicle.drag_ratio, 0.06)
        with pytest.raises(InputError, match="arm_length"):
            Vehicle(drag_to_thrust=drags, drag_ratio=0.1)

    def test_equal_arms_are_the_same_vehicle_in_both_ways(self) -> None:
        places = PAPER.replace(rotor_height=0.01, first_arm_angle=0.3)
        assert places.arm_length is not None
        positions = places.arm_length * np.array(places.scaled_positions)
        again = PAPER.replace(rotor_positions=positions)
        assert again.rotor_positions is None
        for name in ("arm_length", "first_arm_angle", "rotor_height", "drag_ratio"):
            assert math.isclose(getattr(again, name), getattr(places, name))

    def test_they_are_kept_in_files_and_changed(self, tmp_path: Path) -> None:
        text = f"drag_to_thrust = [0.01, 0.02, 0.01, 0.02]\nrotor_positions = {RECTANGLE}\n"
        vehicle = vehicle_named(written(tmp_path, text))
        assert vehicle_from_mapping(vehicle.as_mapping()) == vehicle
        assert vehicle.replace(mass=2.0).rotor_positions == vehicle.rotor_positions
        for name in ("arm_length", "first_arm_angle", "rotor_height"):
            with pytest.raises(InputError, match=f"{name} must be omitted beside"):
                vehicle.replace(**{name: 0.3})
        square = vehicle.replace(rotor_positions=None, arm_length=0.3)
        assert square.rotor_positions is None
        again = Vehicle(
            drag_to_thrust=np.array([0.01, 0.02, 0.01, 0.02]),
            rotor_positions=[np.array(place) for place in RECTANGLE],
        )
        assert again.scaled_drags == vehicle.scaled_drags

    @pytest.mark.parametrize(
        ("rotor", "place", "reason"),
        [
            (1, [-0.2, 0.16, 0.0], r"rotors 2 and 4 at \(-0\.2, 0\.16, 0\)"),
            (2, [-0.2, -0.15, 0.1], "rotors 1 and 3 at"),
        ],
    )
    def test_the_pair_that_is_not_symmetric_is_named(
        self, rotor: int, place: list[float], reason: str
    ) -> None:
        places = [*RECTANGLE]
        places[rotor] = place
        vehicle = Vehicle(drag_to_thrust=0.02, rotor_positions=places)
        assert re.search(reason, str(vehicle.asymmetry))

    def test_a_pair_of_unequal_drag_is_named(self) -> None:
        drags = [0.01, 0.02, 0.01, 0.03]
        vehicle = Vehicle(drag_to_thrust=drags, rotor_positions=RECTANGLE)
        assert (
            vehicle.asymmetry
            == "rotors 2 and 4 with a drag_to_thrust of 0.02 and 0.03 m"
        )

    @pytest.mark.parametrize(
        "places",
        [
            "x",
            [[1, 0, 0]],
            RECTANGLE[::-1],
            [[0, 0, 0.1], *RECTANGLE[1:]],
            [[0.2, 0.15, math.nan], *RECTANGLE[1:]],
            [[0.2, 0.15, 30.0], *RECTANGLE[1:]],
        ],
    )
    def test_what_is_not_four_places_around_body_z_is_refused(
        self, places: Any
    ) -> None:
        with pytest.raises(InputError, match="rotor_positions must be") as caught:
            Vehicle(drag_to_thrust=0.02, rotor_positions=places)
        assert caught.value.field == "rotor_positions"


PAIRED = ["clockwise", "clockwise", "counterclockwise", "counterclockwise"]
LEANING = [[0.2, 0.15, 0.05], [-0.2, 0.1, 0.0], [-0.2, -0.15, 0.0], [2.0, -1.5, 0.3]]


class TestAxes:
    """Rotors with tilt axes, thrust axes and spins of their own."""

    @pytest.mark.parametrize(
        "stated",
        [
            {"tilt_axes": [[x, y, 0.0] for x, y, _ in RECTANGLE]},
            {"thrust_axes": [[0.0, 0.0, 2.0]] * 4},
            {"thrust_axes": [[x, y, 0.3] for x, y, _ in RECTANGLE]},
            {"spins": ["clockwise", "counterclockwise"] * 2},
        ],
    )
    def test_the_default_ones_are_the_same_vehicle(self, stated: Any) -> None:
        plain = Vehicle(drag_to_thrust=0.02, rotor_positions=RECTANGLE)
        vehicle = Vehicle(drag_to_thrust=0.02, rotor_positions=RECTANGLE, **stated)
        assert vehicle == plain
        assert vehicle.as_mapping() == plain.as_mapping()
        assert repr(vehicle) == repr(plain)

    def test_alternating_spins_are_those_of_the_first_rotor(self) -> None:
        spins = ["counterclockwise", "clockwise"] * 2
        assert PAPER.replace(spins=spins) == PAPER.replace(
            first_rotor_spin="counterclockwise"
        )

    @pytest.mark.parametrize(
        "stated",
        [
            {"tilt_axes": LEANING},
            {"thrust_axes": [[0.1, 0.0, 1.0], *[[0.0, 0.0, 1.0]] * 3]},
            {"spins": PAIRED},
            {"spins": PAIRED, "tilt_axes": LEANING, "thrust_axes": [[0, 0.1, 1]] * 4},
        ],
    )
    def test_they_are_kept_in_files_and_changed(
        self, stated: Any, tmp_path: Path
    ) -> None:
        text = f"drag_to_thrust = 0.02\nrotor_positions = {RECTANGLE}\n"
        text += "".join(
            f"{name} = {json.dumps(value)}\n" for name, value in stated.items()
        )
        vehicle = vehicle_named(written(tmp_path, text))
        assert (
            json.loads(json.dumps(vehicle.as_mapping())) | stated
            == vehicle.as_mapping()
        )
        assert vehicle_from_mapping(vehicle.as_mapping()) == vehicle
        assert vehicle.replace(mass=2.0).replace(mass=None) == vehicle
        plain = vehicle.replace(tilt_axes=None, thrust_axes=None, spins=None)
        assert plain.asymmetry is None
        assert vehicle.asymmetry is not None
        assert not vehicle.carries_published_coefficients
        for name in stated:
            assert name.replace("_", " ") in str(vehicle)

    def test_axes_are_unit_vectors_that_are_perpendicular(self) -> None:
        thrust = np.array([[0.1, 0.0, 1.0], [0, 0, 5], [0, -1, 1], [0, 0.2, -3]])
        vehicle = PAPER.replace(tilt_axes=LEANING, thrust_axes=thrust)
        tilt, across = vehicle.axes
        for axes in (tilt, across):
            assert np.allclose(np.linalg.norm(axes, axis=1), 1.0)
        assert np.abs(np.sum(tilt * across, axis=1)).max() < 1e-15
        assert np.abs(np.cross(tilt, LEANING)).max() < 1e-15
        assert np.abs(np.linalg.det(np.stack([tilt, across, thrust], 1))).max() < 1e-15

    @pytest.mark.parametrize(
        ("stated", "message"),
        [
            ({"tilt_axes": [[0, 0, 0], *LEANING[1:]]}, "rotor 1, which then cannot tilt"),
            ({"thrust_axes": [*LEANING[1:], [0, 0, 0]]}, "rotor 4, which then cannot thrust"),
            ({"tilt_axes": LEANING[:3]}, "tilt_axes must be four directions"),
            ({"tilt_axes": [*LEANING[:3], [0, 0, 1]]}, "tilt_axes must be such that tilting turns the thrust, got .* for rotor 4"),
            ({"thrust_axes": RECTANGLE}, r"thrust_axes must be .* \(0.2, 0.15, 0\) .* for rotor 1"),
            ({"tilt_axes": [[0, 0, 1]] * 4, "thrust_axes": RECTANGLE}, "vehicle must lift"),
            ({"spins": PAIRED[:3]}, "spins must be four words"),
            ({"spins": ["left", *PAIRED[1:]]}, "spins must be one of"),
            ({"spins": PAIRED, "first_rotor_spin": "counterclockwise"}, "first_rotor_spin must be omitted"),
        ],
    )  # fmt: skip
    def test_what_the_vehicle_cannot_do_is_said(
        self, stated: dict[str, Any], message: str
    ) -> None:
        with pytest.raises(InputError, match=message) as caught:
            Vehicle(drag_to_thrust=0.02, rotor_positions=RECTANGLE, **stated)
        assert caught.value.field in {*stated, "vehicle"}

    @pytest.mark.parametrize(
        ("shift", "message"),
        [(0.0, r"none about \(-?0, -?0, -?1\)"), (0.01, "without the others")],
    )
    def test_rotors_without_a_moment_about_an_axis_are_refused(
        self, shift: float, message: str
    ) -> None:
        """Tangential tilt axes that lean so that drag and lever cancel: the yaw torque is a multiple of the lift."""
        drags = np.array([1, -1, 1, -1]) * 0.02  # with the sign of the spin
        axes = np.cross([0.0, 0.0, 1.0], RECTANGLE) + [0.0, 0.0, 1.0] * (
            drags[:, None] + shift
        )
        with pytest.raises(InputError, match=message):
            Vehicle(drag_to_thrust=0.02, rotor_positions=RECTANGLE, tilt_axes=axes)
        axes[0, 2] += 0.001
        Vehicle(drag_to_thrust=0.02, rotor_positions=RECTANGLE, tilt_axes=axes)

    def test_no_drag_at_all_is_no_yaw(self) -> None:
        with pytest.raises(InputError, match="cannot yaw at zero tilt"):
            Vehicle(drag_to_thrust=[0.0] * 4, rotor_positions=RECTANGLE)


def test_rotor_positions_in_millimetres_are_named_in_the_warning() -> None:
    places = [[150, 200, 0], [-150, 200, 0], [-150, -200, 0], [150, -200, 0]]
    vehicle = Vehicle(mass=1.6, drag_to_thrust=16, rotor_positions=places)
    assert vehicle.warnings == (
        "rotor_positions = (150, 200, 0) of rotor 1 with a mass of 1.6 kg: it is in metres; if this is in mm, write "
        "(0.15, 0.2, 0)",
    )


@pytest.mark.parametrize("name", ["arm_length", "first_arm_angle", "rotor_height"])
def test_a_constant_of_equal_arms_beside_a_preset_with_positions(name: str) -> None:
    with pytest.raises(
        InputError,
        match=f"{name} must be omitted beside the preset 'beetle_art', which states rotor_positions, got 0.1",
    ):
        vehicle_from_mapping({"preset": "beetle_art", name: 0.1})


def test_vehicles_shows_both_crossing_lines_where_they_differ(
    run: Any, tmp_path: Path
) -> None:
    file = tmp_path / "two_drags.toml"
    file.write_text("arm_length = 0.25\ndrag_to_thrust = [0.016, 0.02, 0.016, 0.02]\n")
    first, second = coefficients_of(vehicle_named(file)).crossings
    line = f"planes cross at α1 = {first:.6f} rad and α2 = {second:.6f} rad"
    assert line in run("vehicles", file).out
    shown = run("vehicles", file, "--json").json["vehicles"][0]
    assert (shown["delta"], shown["crossings"]) == (first, [first, second])
    assert "δ = " in run("vehicles", "beetle_omni").out

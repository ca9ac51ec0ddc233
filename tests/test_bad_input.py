"""Bad input: one base error, and one line that names the argument, what is allowed, and the value."""

from __future__ import annotations

import errno
import inspect
import json
import math
import os
import pickle
import re
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.errors import FileProblem, InputError
from gaitgraph.files import (
    check_new_files,
    from_toml_file,
    naming_file,
    text_of,
    write_whole,
)
from gaitgraph.flight.flight import FlightSettings, settings_from_mapping
from gaitgraph.study.design import study_from_mapping
from tests.calls import CALLS, FUNCTIONS, GEOMETRY, ROWS, TIMED, X_FRAME
from tests.samples import cases

NAN, INF, RIGHT = math.nan, math.inf, math.pi / 2
HIDDEN = np.ma.array([0.3, 0.4], mask=[False, True])
MASKED: Any = np.ma.masked_equal([[0.1] * 4, [0.1, 9.0, 0.1, 0.1]], 9.0)
NO_NUMBERS: list[Any] = [NAN, INF, "fast", [], {}, 1j, True, -(10**400), np.ma.masked]
NOT_POSITIVE = [*NO_NUMBERS, 0.0, -1.0]
NEGATIVE = [*NO_NUMBERS, -1e-9]
NOT_WHOLE = [*NO_NUMBERS, 1.5, "1"]
NO_ANGLES = [NAN, INF, "x", None, 1j, [0.1, [0.2]], {}, 1e300, np.ma.masked]
NO_ROWS = [None, [], "x", [[0.1] * 3], [[0.1, 0.2, 0.3, NAN]], [["a"] * 4], MASKED]
NO_POINTS = [None, (), "0,0", np.array(0.3), [(0.0, NAN)], [("x", 0.0)], [0.1]]
NO_GAIT = [*NO_ROWS, 3, {}, b"x", "none.csv", np.zeros((2, 3)), object()]
NO_CHOICE = [1, "up", ["red"], {}]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
BOW = [(0, 0), (1, 1), (1, 0), (0, 1)]
TOUCHING = [(0, 0), (1, 1), (2, 0), (2, 2), (1, 1), (0, 2)]
TINY = [(0, 0), (1e-7, 0), (0, 1e-7)]
NO_ZONES = [5, "square", [SQUARE, "square"], [SQUARE, BOW], [TOUCHING], [TINY]]
NO_ZONES += [[[(0, 0), (1, 0), end]] for end in ((0.5,), (0, "x"), (1e7, 1))]
EXACT_GAIT = gg.lift([(0.8, -0.8)], "red", coefficients="exact")
BEETLE = gg.vehicle_named("beetle_omni")

# What is refused as an argument of this name by each function that has one; "function.argument" goes before it.
WRONG: dict[str, list[Any]] = {
    name: eval(f"[{values}]")
    for name, values in cases("""
about | 3, "x", []
accuracy | *NOT_POSITIVE, 0.99e-9, 0.101
alpha | *NO_ROWS
alpha1 | *NO_ANGLES
alpha2 | *NO_ANGLES
angle_rounding | *NEGATIVE, 5
any_order | 1, "yes"
angles | None, 3, (1, 1), (1, 5), (1, [2])
attitude | (0.1,), (4.0, 0.0), (0.0, 1.6), np.array(0.3)
begins | *NOT_WHOLE, 0
bias | 0.0, 1.1, NAN, "x"
certificate | None, 3, []
coefficients | "rough", 3, []
color | *NO_CHOICE
columns | None, "x", [[0.1, 0.2]]
colors | 3, "green", ["red"], ["red", "blue", "green"], [["red"]] * 3
concession | *NO_NUMBERS, 0, 0.51
corner | *NOT_WHOLE, -1, 3
crossing_tolerance | *NEGATIVE
curves | *NOT_WHOLE, -1, 10_001
divisions | *NOT_WHOLE, 1, 257
disc | *NEGATIVE
duration | *NO_NUMBERS, 0, 0.99e-6, 5.01e8
end | *NO_GAIT, "hovr"
first | "(+,-)", "(+,−)", "", "+,+", "(+)", "(+,+", "(+,+,+)", "[+,+]", "(*,*)", 3
extent | *NO_NUMBERS, "90deg", 0
floor | *NEGATIVE
formats | None, 3, "png", ["gif"]
gait | *NO_GAIT
gaits | None, 3, "gait3", [], [3]
graph | None, 3, {}
keep | *NO_NUMBERS, 0, 1.01
keep_in | *NO_ZONES, [[(2, 2), (3, 2), (3, 3)]]
keep_out | *NO_ZONES
lag | *NO_NUMBERS, 0.0, -1.0, [0.1, 0.2], [0.1, 0.1, 2e6, 0.1], 3e-5
law | *NO_CHOICE
limits | 3, {"rate": 5}
margin | *NO_ANGLES[:3], -1, 5.0
max_length | *NEGATIVE, 1e13
nodes | *NOT_WHOLE, 5
names | 3, "gait3", ["one"]
objective | *NO_CHOICE
order | *NOT_WHOLE, 0, 5
only | 3, "16", ["0"]
out | None, 3
path | *NO_GAIT
paths | None, 3, "a.csv", [3]
period | *NO_NUMBERS, 0.0, 0.99e-6, 1.01e9
periods | *NOT_WHOLE, 0
pieces | *NOT_WHOLE, 7, 401
pitch | *NO_ANGLES
points | *NO_POINTS
radius | *NO_ANGLES[:3], -1, 6.3, [0.1, 0.2]
rate | *NO_NUMBERS, -1.0, 1e300
require | *NO_CHOICE
resolution | *NOT_WHOLE, 0, 317
reverse | 1, "yes"
roll | *NO_ANGLES
samples | *NOT_WHOLE, 0, 10_000_001
scale | NAN, INF, "x", 0, 1.0001
servo_margin | *NO_ANGLES[:3], -1
share | *NOT_POSITIVE
sign | *NO_CHOICE
source | *NO_GAIT
start | *NO_GAIT
step | *NOT_POSITIVE
stops | None, 3, "abc", [], [3]
table | None, 3, {}
thrusts | "x", [1.0], [1.0, 1.0, 1.0, NAN]
tilt | *NO_ANGLES[:3], -0.1, RIGHT
tolerance | NAN, INF, -1.0, "x"
vehicle | 3, True, {}, "padovo", "none.toml"
waypoints | *NO_POINTS, [(0, 0, 0)], [(2.0, 0)], [(0, 0)] * 1001
width | *NEGATIVE
zones | 3, "x", [SQUARE], {}
Gait.colors | None, 3, "green", ["red"]
TimedGait.gait | None, "gait4"
TimedGait.period | -1.0, NAN, INF
TimedGait.samples | 0, 10**8
TimedGait.with_period.period | "x", 0.0, INF
angles.distance_to_multiple.period | *NOT_POSITIVE
angles.wrapped.period | *NOT_POSITIVE
plots.vehicle_view.attitude | "x", (0.1, 0.2), np.full((3, 3), NAN)
io.Joint.sign | 0, 2, "1"
plots.write_figures.gait | *NO_GAIT[1:]
planning.Replanner.rate | *NO_NUMBERS, 0.0
robustness.servo_margin.tolerance | *NOT_POSITIVE, 1.01
roots.alpha1 | *NO_ANGLES, RIGHT + 0.001
root_arrays.alpha2 | *NO_ANGLES[:-1], RIGHT + 0.001
surface.sign_region.coefficients | *[]
surface_graph.waypoints | *NO_POINTS[2:], [(0, 0, 0)], [(2.0, 0)]
validation.validate_geometry.table | *NO_GAIT
""")
}

# What arguments are called in messages, where that is not their own name.
NOUNS = {
    **dict.fromkeys(("gait", "source", "path", "start", "end"), "gait|alpha|start|end"),
    **dict.fromkeys(("gaits", "table"), "gait|alpha|table"),
    "formats": "format",
    "paths": "path|output",
    "points": "alpha|point",
    "waypoints": "waypoint",
    "first": "types",
}
ARGUMENTS = [
    (name, argument)
    for name in CALLS
    for argument in inspect.signature(FUNCTIONS[name]).parameters
    if argument in WRONG
]


def refusal(name: str, **changes: Any) -> Any:
    """Return the error of a call with some arguments changed."""
    with pytest.raises(gg.GaitgraphError) as caught:
        FUNCTIONS[name](**CALLS[name] | changes)
    assert "\n" not in str(caught.value)
    return caught.value


def refused(call: str) -> Any:
    """Return the error of a call with some arguments changed, as in "plan_loop(period=0)"."""
    name, _, changes = call.partition("(")
    return refusal(name, **eval(f"dict({changes}"))


@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_a_wrong_argument_is_named_in_one_line(name: str, argument: str) -> None:
    for value in WRONG.get(f"{name}.{argument}", WRONG[argument]):
        error = refusal(name, **{argument: value})
        if error.path is None and error.row is None:
            named = f"{error.field} {error}"
            assert re.search(NOUNS.get(argument, argument), named), (value, named)
        check_held(error, value)


def check_held(error: gg.GaitgraphError, value: object) -> None:
    """Check that an error holds what its message says, and states the same in JSON."""
    assert error.field is not None or error.path is not None, value
    # No value is held where none came, or a part of it is masked.
    has_none = value is None or re.search("got none|got one", str(error))
    says_value = ", got " in str(error) and not has_none
    assert error.value is not None or not says_value, value
    stated = json.loads(json.dumps(error.as_mapping(), allow_nan=False))
    assert stated["message"] == error.message
    for known in ("field", "row", "path"):
        assert stated.get(known) == getattr(error, known)
    assert ("value" in stated) == (error.value is not None)


def numbers_of_calls() -> list[tuple[str, str, Any]]:
    """Return the arguments of calls that are numbers, where they are given or by default, with other kinds of number."""
    found: list[tuple[str, str, Any]] = []
    for name, given in CALLS.items():
        parameters = inspect.signature(FUNCTIONS[name]).parameters.values()
        stated = {one.name: given.get(one.name, one.default) for one in parameters}
        for argument, value in stated.items():
            if type(value) is int:
                found.append((name, argument, np.int64(value)))
            if type(value) is float:
                found.append((name, argument, Fraction(repr(value))))
                found.append((name, argument, Decimal(repr(value))))
    return found


@pytest.mark.parametrize(("name", "argument", "number"), numbers_of_calls())
def test_numbers_of_any_kind_are_numbers(
    name: str, argument: str, number: Any, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    plain = int(number) if isinstance(number, np.integer) else float(number)
    # Some functions return a number of numpy for one that is not Python's; an address in memory says nothing.
    unlike = r"np\.float64\((.*?)\)| at 0x\w+"
    answer, expected = (
        re.sub(unlike, r"\1", repr(FUNCTIONS[name](**CALLS[name] | {argument: value})))
        for value in (number, plain)
    )
    assert answer == expected


CHOICES = set("reference arms saturation seed wind".split())


@pytest.mark.parametrize("name", sorted(FlightSettings().as_mapping().keys() - CHOICES))
def test_settings_of_a_flight_are_numbers_in_their_range(name: str) -> None:
    for value in (*NO_NUMBERS[:-1], -1.0, 1e300):
        content = {name: value}
        assert name in str(refusal("flight.settings_from_mapping", content=content))


@pytest.mark.parametrize(
    ("call", "said"),
    cases("""
Limits(acceleration=None) | an acceleration or a jerk, got neither
Limits(rate=[0.1, [0.2]]) | rate
basins_of(resolution=317, bias=[0.8, 0.9]) | 100000 flights, got 200978
basins_of(bias=[0.8, 1.0, 0.8]) | bias must be different
basins_of(settings=FlightSettings(duration=0.99)) | duration
basins_of(settings=FlightSettings(reference="hover")) | reference
cycles(require="fly") | flyable, valid, two_color
export(outputs=["a.csv", 3.0]) | output must be the path of a file
flight.Engine(vehicle=BEETLE.replace(mass=1e-18)) | mjMINVAL|range of the
invertibility.coefficients_of(vehicle=BEETLE, kind="published") | exact
least_period(path=TIMED.gait.biased(0.8)) | color
least_period(rounding=-1.0) | rounding
least_period(samples=3, rate=5.0) | samples and rate must not both
optimal_gait(floor=memoryview(b"1")) | got <memory
optimal_gait(waypoints=[(0, 0)] * 41) | at most 40, got 41
retarget(source=np.zeros((200_001, 4))) | at most 200000 rows
timing.rounded(tolerance=0.9e-5) | tolerance
transition(end="hover", coefficients="rough") | coefficients
transition(start=TIMED, end=EXACT_GAIT) | end must be a gait for
transition(rate=10, samples=10) | samples and rate must not both
validate(gait=TIMED, vehicle=gg.PAPER) | vehicle must be None beside a
flight.settings_from_mapping(content={"atitude_noise": 0.1}) | did you mean 'attitude_noise'
flight.settings_from_mapping(content={"tolerance": 10.1}) | tolerance
flight.settings_from_mapping(content={"gust": 100.01}) | gust
flight.settings_from_mapping(content={"reference": "hoover"}) | reference
flight.settings_from_mapping(content={"saturation": 1}) | saturation
flight.settings_from_mapping(content={"seed": -1}) | seed
flight.settings_from_mapping(content={"seed": 2**64}) | seed
flight.settings_from_mapping(content={"wind": "12"}) | wind
flight.settings_from_mapping(content={"wind": (1, NAN)}) | wind
flight.settings_from_mapping(content={"wind": (1, 2, 100.1)}) | wind
flight.settings_from_mapping(content={"control_rate": 300.0}) | 1000 Hz divided by a whole number
flight.settings_from_mapping(content={"attitude_damping": 2100.0}) | attitude_damping must be between 0.05125
flight.settings_from_mapping(content={"altitude_damping": 1e-3, "control_rate": 100}) | between 0.5125
flight.settings_from_mapping(content={"altitude_stiffness": 1.95e6, "altitude_damping": 999.0}) | less than 1.95
"""),
)
def test_a_rule_of_its_own_is_said(call: str, said: str) -> None:
    assert re.search(said, str(refused(call)))


SWEEP = {"from": 1, "to": 2, "count": 2}
SHARES = {"from": 0.1, "to": 1, "count": 100}


@pytest.mark.parametrize(
    ("changes", "said"),
    cases("""
gait=["gait3"] | the study has no field 'gait'; did you mean 'gaits'
gaits=["gait5"] | gait 1: gait file
gaits=[{"waypoints": [[0, 0]], "period": 2.0}] | gait 1: .* 'period'
gaits=[{"file": 3}] | gait 1: gait file
vehicles=["paper", "paper"] | names of vehicles
vehicles=[{"preset": "paper", "mass": {"to": 1}}] | vehicle 1: mass
biases=[0.8, 1.2] | biases
periods=9e-7 | periods
periods={**SWEEP, "to": 1} | periods must be .* from below to
periods={**SWEEP, "count": 1} | periods.count
attitudes={"roll": 3.15} | roll
attitudes={"pitch": 1.6} | pitch
flight={"durations": 1} | did you mean 'duration'
sample={"seed": 3} | sample.kind
sample={"kind": "sobol", "count": 2} | sample.kind
sample={"count": 2, "seed": -1} | sample.seed
sample={"count": 2, "seed": 2**64} | sample.seed
anyway="yes" | anyway
periods={**SWEEP, "count": 90000}, biases=SHARES | got 9000000
"""),
)
def test_a_wrong_study_is_refused(changes: str, said: str) -> None:
    stated = {"name": "small", "gaits": ["gait1"]} | eval(f"dict({changes})")
    with pytest.raises(InputError, match=said) as caught:
        study_from_mapping(stated)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("call", "degrees"),
    cases("""
plan_loop(waypoints=[(0, 30)]) | 30deg
plan_loop(waypoints=[("−30", 0)]) | −30deg
plan_loop(keep_out=[[(30, -60), (40, -60), (40, -50)]]) | 30deg
optimal_gait(radius=10) | 10deg
retarget(margin=5.0) | 5deg
validate(angle_rounding=5) | 5deg
Vehicle(max_tilt=60) | 60deg
Vehicle(first_arm_angle=45) | 45deg
invertibility.least_singular_value_within(tilt=30) | 30deg
"""),
)
def test_degrees_without_a_unit_are_shown_with_it(call: str, degrees: str) -> None:
    error = refused(call)
    assert str(error).endswith(f"; for degrees write '{degrees}'")
    assert f"({error.field}=" in call


@pytest.mark.parametrize(
    ("call", "end"),
    cases("""
color="rad" | color must be one of auto, red, blue, got 'rad'; did you mean 'red'?
floor=NAN | floor must be a number from 0 to 1e12, got nan
floor=np.array([[2.5]], dtype=np.longdouble) | got [[2.5]]
floor=np.ma.masked | got masked
floor=np.ma.array([2.5]) | got [2.5]
floor=np.float64 | got <class 'numpy.float64'>
color="a" * 68 | aaa'
color="a" * 69 | aaa…
color=10**5000 | number of 16610 bits
"""),
)
def test_the_message_says_what_is_allowed_and_what_came(call: str, end: str) -> None:
    """A value is shown up to 70 signs."""
    assert str(refused(f"plan_loop({call})")).endswith(end)


COLUMNS: dict[str, Any] = {"alpha1": [0.3, 0.4], "alpha2": HIDDEN, "color": "red"}


@pytest.mark.parametrize(
    "refused",
    [
        lambda: gg.gait_of(COLUMNS),
        lambda: gg.gait_of(tuple(MASKED)),
        lambda: gg.Table(columns=COLUMNS),
        lambda: gg.lift(MASKED[:, :2], "red"),
        lambda: gg.invertibility.decoupling_matrix(ROWS[0], roll=HIDDEN),
        lambda: gg.surface.root_arrays(0.1, HIDDEN),
        lambda: gg.surface.hover_region().contains(MASKED[:, :2]),
        lambda: TIMED.at(HIDDEN),
        lambda: gg.io.tilts_from_joints(
            dict.fromkeys((joint.column for joint in X_FRAME.joints), HIDDEN), X_FRAME
        ),
    ],
)
def test_a_masked_value_is_refused_with_its_row(refused: Any) -> None:
    with pytest.raises(InputError, match="no masked values, got one in row 2"):
        refused()


def test_a_masked_array_without_a_masked_value_is_an_array() -> None:
    unmasked: Any = np.ma.array(ROWS, mask=False)
    assert gg.validate(unmasked).checks == gg.validate(ROWS).checks


@pytest.mark.parametrize(
    ("changed", "said"),
    cases("""
alpha1=[], alpha2=[], alpha3=[], alpha4=[] | it must have at least one row
alpha1=[0.1] | columns must have the same number of rows
color=["red"] | columns must have the same number of rows
alpha1=[0.1, None] | row 2: alpha1
alpha1=["a", 0.1] | row 1: alpha1
alpha1=[[0.1], [0.1]] | row 1: alpha1
t=[0.0, 0.0] | row 2: t must be at least
color=["red", "green"] | row 2: color
types=["red", "green"] | row 1: types
"""),
)
def test_a_table_made_by_hand_obeys_the_rules_of_a_file(
    changed: str, said: str
) -> None:
    columns: dict[str, Any] = {f"alpha{k}": [0.1, 0.2] for k in range(1, 5)}
    table = gg.Table(columns=columns | eval(f"dict({changed})"))
    for function in (gg.validate, gg.gait_of, gg.timing.timed_gait_of, gg.Table.plot):
        with pytest.raises(InputError, match=f"^{said}"):
            function(table)


@pytest.mark.parametrize(
    "function",
    [
        gg.invertibility.segment_bounds.least_singular_value_along,
        GEOMETRY.least_singular_value_along,
        GEOMETRY.least_hover_thrust_along,
    ],
)
def test_there_is_no_least_value_along_no_segments(function: Any) -> None:
    for points in (np.zeros((0, 4)), [], [[0.1, 0.2]]):
        with pytest.raises(InputError, match="^starts must have the shape"):
            function(points, points)
    with pytest.raises(InputError, match="^ends must be as many as starts"):
        function(ROWS, ROWS[:2])


def test_an_error_carries_field_row_value_and_path_through_a_pickle(
    tmp_path: Path,
) -> None:
    path = tmp_path / "gait.csv"
    for cell, value in (("x", "x"), ("4.5", 4.5)):
        path.write_text(f"alpha1,alpha2,alpha3,alpha4\n0,0,0,0\n0,{cell},0,0\n")
        with pytest.raises(InputError) as caught:
            gg.read_table(path)
        error = pickle.loads(pickle.dumps(caught.value))
        assert (error.field, error.row, error.value) == ("alpha2", 2, value)
        assert error.path == str(path)
        assert str(error) == str(caught.value)


@pytest.mark.parametrize(
    ("call", "field", "row", "value"),
    cases("""
plan_loop(period=0) | period | None | 0
plan_loop(waypoints=[(0.1, 0.2), (0.1, 30)]) | waypoints | 2 | 30
plan_loop(waypoints=[(0.1, 0.2, 0.3)]) | waypoints | 1 | (0.1, 0.2, 0.3)
plan_loop(keep_out=[SQUARE, [(0, "x")]]) | keep_out | 2 | 'x'
plan_loop(vehicle={"drag_ratio": -2}) | vehicle.drag_ratio | None | -2
plan_loop(vehicle={"drag_ratios": 2}) | vehicle.drag_ratios | None | None
plan_loop(vehicle="padovo") | vehicle | None | 'padovo'
Vehicle(drag_ratio=-2) | drag_ratio | None | -2
Vehicle(first_rotor_spin="left") | first_rotor_spin | None | 'left'
Limits(acceleration=[1, 2]) | acceleration | None | [1, 2]
Gait(alpha=[ROWS[0], [0.1, 0.2, 1e7, 0.4]]) | alpha | 2 | 10000000.0
Gait(alpha=tuple(MASKED)) | alpha | 2 | None
validate(gait="gait.cvs") | None | None | '.cvs'
surface_graph(divisions=0.5) | divisions | None | 0.5
io.Joint(sign=2) | sign | None | 2
"""),
)
def test_an_error_says_which_value_is_wrong(
    call: str, field: str, row: str, value: str
) -> None:
    error = refused(call)
    assert (str(error.field), str(error.row)) == (field, row)
    assert repr(error.value) == value
    assert error.path == ("gait.cvs" if "cvs" in call else None)


# Files


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[flight]\nseed = 1\n[other]\n", "other must be inside the .flight. table"),
        ("flight = 3", "flight must be a table of values by name, got 3"),
        ("seed = [", "it is not TOML .*; texts need quotes"),
        (f"seed = {'[' * 5000}", "it is nested too deeply"),
        ("seed = -1", "seed must be"),
    ],
)
def test_a_wrong_toml_file_is_named(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(content)
    with pytest.raises(InputError, match=f"^flight file .*a.toml': {said}") as caught:
        from_toml_file(path, "flight", settings_from_mapping)
    assert "\n" not in str(caught.value)
    assert caught.value.path == str(path)


@pytest.mark.parametrize(
    ("what", "hint"), [("gait file", True), ("certificate", False)]
)
def test_a_file_of_other_bytes_is_no_text(
    tmp_path: Path, what: str, hint: bool
) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"t\xff")
    with pytest.raises(InputError, match="must be UTF-8 text") as caught:
        text_of(path, what)
    assert ("in Excel save it as CSV UTF-8" in str(caught.value)) == hint
    path.write_bytes("ü".encode("utf-8-sig"))
    assert text_of(path, what) == "ü"


def test_files_are_written_whole_or_not_at_all(tmp_path: Path) -> None:
    first, link, fresh = tmp_path / "a.csv", tmp_path / "link.csv", tmp_path / "b.csv"
    first.write_text("old")
    first.chmod(0o640)
    link.symlink_to(first)
    with pytest.raises(gg.errors.OutputExists, match="exists"):
        write_whole([(fresh, b"new"), (first, b"new")], force=False)
    with pytest.raises(FileProblem, match="'/proc/bad' cannot be written"):
        write_whole([(fresh, b"new"), (Path("/proc/bad"), b"new")], force=True)
    assert not fresh.exists()
    assert first.read_text() == "old"
    write_whole([(fresh, b"new"), (link, b"new")], force=True)
    assert (fresh.read_text(), first.read_text()) == ("new", "new")
    assert link.is_symlink()
    assert first.stat().st_mode & 0o777 == 0o640
    assert {*tmp_path.iterdir()} == {first, link, fresh}


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        (["a.csv", "./a.csv"], "outputs must differ, got .*a.csv' twice"),
        (["folder"], "output .* must be a regular file, got a folder"),
        (["none/a.csv"], "output folder .*none' does not exist"),
        (["file/a.csv"], "output .*file.* is not a folder|Not a directory"),
        (["nu\0ll.csv"], "cannot be written"),
        (["x" * 300], "File name too long"),
        (["pipe"], "got a special file"),
        (["loop"], "exists|cannot be written|symbolic link"),
        (["file"], "exists; overwrite it with force=True"),
    ],
)
def test_outputs_are_checked_before_any_work(
    tmp_path: Path, outputs: list[str], said: str
) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(gg.GaitgraphError, match=said):
        check_new_files([f"{tmp_path}/{name}" for name in outputs], force=False)
    check_new_files([tmp_path / "new.csv", tmp_path / "other.csv"], force=False)
    check_new_files([tmp_path / "file"], force=True)


def test_an_error_names_its_file_once() -> None:
    with (
        pytest.raises(InputError) as caught,
        naming_file("a.toml", "request file"),
        naming_file("a.toml"),
    ):
        raise InputError("gait files must be shorter", field="gait")
    assert str(caught.value) == "gait file 'a.toml': gait files must be shorter"
    assert (caught.value.path, caught.value.field) == ("a.toml", "gait")


def test_problems_of_files_keep_what_the_system_says(tmp_path: Path) -> None:
    path = str(tmp_path / "none.csv")
    with pytest.raises(FileProblem, match=": No such file or directory$") as caught:
        gg.read_table(path)
    assert caught.value.errno == errno.ENOENT
    assert caught.value.filename == caught.value.path == path
    # As from another process.
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.errno, again.filename) == (errno.ENOENT, path)
    assert again.as_mapping() == caught.value.as_mapping()
    with pytest.raises(FileProblem) as caught:
        TIMED.write(f"{'a' * 300}.csv")
    assert caught.value.errno == errno.ENAMETOOLONG
    TIMED.write(path)
    with pytest.raises(gg.errors.OutputExists) as exists:
        TIMED.write(path)
    assert (exists.value.errno, exists.value.filename) == (errno.EEXIST, path)


def test_a_value_that_is_nested_too_deeply_is_told_by_its_kind() -> None:
    nested: Any = []
    for _ in range(5000):
        nested = [nested]
    error = InputError("it must be flat", value=nested)
    assert error.as_mapping()["value"] == "a list"


@pytest.mark.parametrize(("shape", "entries"), [((25, 4), 25), ((101, 1), 100)])
def test_a_hundred_numbers_of_an_array_are_kept(shape: Any, entries: int) -> None:
    error = InputError("", value=np.zeros(shape))
    assert len(error.as_mapping()["value"]) == entries

"""Vehicles in files of others, and tilt tables on rotors of any geometry, through the command line too."""

from __future__ import annotations

import json
import math
import shlex
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gaitgraph as gg
from gaitgraph.flight.vehicle_files import read_description
from gaitgraph.invertibility.geometry import Geometry, geometry_from_mapping
from gaitgraph.validation.any_rotors import validate_geometry
from gaitgraph.vehicle import preset_names, vehicle_named
from tests.samples import cases

if TYPE_CHECKING:
    from collections.abc import Sequence

pytest.importorskip("mujoco")
RNG = np.random.default_rng(5)
START = RNG.bit_generator.state


@pytest.fixture(autouse=True)
def _the_same_numbers_whatever_ran_before() -> None:
    RNG.bit_generator.state = START


# -- URDF of the links and joints that gimbalrotor's description has, with the numbers of its files

INERTIAL = '<inertial><origin xyz="{0}"/><mass value="{1}"/><inertia ixx="{2}" iyy="{3}" izz="{4}" ixy="0" ixz="0" iyz="0"/></inertial>'
BASE = INERTIAL.format("0 0 0.0165", 0.1753, 0.0004, 0.0004, 0.0008)
ARM = f"""
<link name="arm{{k}}">{INERTIAL.format("0.0486 0 0.0161", 0.088, 0.000001, 0.0001, 0.0001)}</link>
<link name="gimbal{{k}}">{INERTIAL.format("0.018 0 0.00438", 0.1095, 0.00002989, 0.00002848, 0.0002698)}</link>
<link name="thrust{{k}}"></link>
<joint name="fixed{{k}}" type="fixed">
  <parent link="base_link"/><child link="arm{{k}}"/><origin xyz="{{x}} {{y}} 0" rpy="0 0 {{turn}}"/>
</joint>
<joint name="tilt{{k}}" type="revolute">
  <parent link="arm{{k}}"/><child link="gimbal{{k}}"/><origin xyz="0.077 0 0.0385"/>
  <axis xyz="1 0 0"/><limit effort="6.6" lower="{{low}}" upper="{{high}}" velocity="3.0"/>
</joint>
<joint name="rotor{{k}}" type="continuous">
  <parent link="gimbal{{k}}"/><child link="thrust{{k}}"/><origin xyz="0.018 0 0.00438"/><axis xyz="0 0 1"/>
</joint>
"""


def urdf(count: int = 4, extra: str = "", low: float = -2.0, high: float = 2.0) -> str:
    arms = ""
    for k in range(count):
        turn = math.pi / 4 + 2 * math.pi * k / count
        x = 0.051 * math.sqrt(2) * math.cos(turn)
        y = 0.051 * math.sqrt(2) * math.sin(turn)
        arms += ARM.format(k=k, x=x, y=y, turn=turn, low=low, high=high)
    return (
        f'<robot name="quad"><link name="base_link">{BASE}</link>{extra}{arms}</robot>'
    )


def test_urdf_gives_the_preset_that_was_derived_from_the_same_numbers(run: Any) -> None:
    Path("quad.urdf").write_text(urdf())
    found, preset = run("vehicles", "--from", "quad.urdf"), vehicle_named("gimbalrotor")
    assert found.code == 1
    assert "the file does not state drag_to_thrust, spins, max_thrust" in found.err
    stated = tomllib.loads(found.out)
    assert {"mass", "inertia", "max_tilt", "max_tilt_rate", "arm_inertia"} <= {*stated}
    assert stated.pop("name") == "quad"
    vehicle = gg.Vehicle(**stated, drag_to_thrust=0.0172)
    for name in (*stated, "arm_length", "first_arm_angle", "rotor_height"):
        if name != "rotor_positions":
            value = getattr(vehicle, name)
            assert np.allclose(value, getattr(preset, name), rtol=1e-4), name
    Path("quad.toml").write_text(f"drag_to_thrust = 0.0172\n{found.out}")
    assert run("vehicles", "quad.toml").code == 0
    assert run("validate", "gait3", "--vehicle", "quad.urdf").err.startswith(
        "gaitgraph: the file must state the drag"
    )


def test_one_rotor_is_described_too(run: Any) -> None:
    Path("one.urdf").write_text(urdf(1))
    done = run("vehicles", "--from", "one.urdf")
    assert "# The paper's method does not fit: it has 1 rotor, not four.\n" in done.out
    assert (done.code, "does not state moment_ratio" in done.err) == (1, True)
    with pytest.raises(gg.InputError, match="must state the drag of its rotors"):
        _ = read_description("one.urdf").geometry


def test_urdf_is_read_without_its_meshes_comments_and_extension(tmp_path: Path) -> None:
    shape = '<{0}><geometry><mesh filename="package://none.dae"/></geometry></{0}>'
    mesh = shape.format("visual") + shape.format("collision")
    text = urdf(extra='<mujoco><compiler fusestatic="true"/></mujoco>')
    extended = text.replace("</link>", f"{mesh}</link>")
    path = tmp_path / "quad.urdf"
    path.write_text(urdf())
    plain = read_description(path)
    path.write_text(f'<!-- <robot name="old"> -->{extended}')
    assert read_description(path) == plain
    path.write_text(urdf(low=0.3, high=7))
    constants = read_description(path).constants
    assert constants["min_tilt"] == 0.3
    assert constants["max_tilt"] == pytest.approx(math.pi)


def test_a_rotor_beside_its_tilt_axis_is_said_where_it_is_judged(run: Any) -> None:
    arms, actuators = "", ""
    for k in range(4):
        x, y = 0.3 * math.cos(k * math.pi / 2), 0.3 * math.sin(k * math.pi / 2)
        beside = f"{-y / 6} {x / 6} 0" if k == 0 else "0 0 0"
        arms += f"""<body pos="{x} {y} 0">
            <joint axis="{x} {y} 0"/><inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>
            <site name="s{k}" pos="{beside}"/></body>"""
        actuators += f'<general site="s{k}" gear="0 0 1 0 0 {0.02 * (-1) ** k}"/>'
    Path("x.xml").write_text(f"""<mujoco><worldbody>
        <body><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{arms}</body>
        </worldbody><actuator>{actuators}</actuator></mujoco>""")
    rows = "alpha1,alpha2,alpha3,alpha4\n0,0,0,0\n-0.1,0.1,-0.1,0.1\n"
    Path("x.csv").write_text(rows)
    told = "warning: rotor 1 is 50 mm beside its tilt axis: taken as on it\n"
    err = run("validate", "x.csv", "--vehicle", "x.xml").err
    assert err == f"gaitgraph: {told}"
    # The drag is that of a unit of thrust, whatever the gear of the actuator.
    before = read_description("x.xml").rotors
    text = Path("x.xml").read_text().replace('gear="0 0 1 0 0 ', 'gear="0 0 3 0 0 ')
    Path("x.xml").write_text(text)
    for rotor, geared in zip(before, read_description("x.xml").rotors, strict=True):
        assert rotor["moment_ratio"] == pytest.approx(3 * geared["moment_ratio"])


@pytest.mark.parametrize("name", preset_names())
def test_models_read_back(run: Any, name: str) -> None:
    preset = vehicle_named(name)
    if preset.rotor_positions is None:
        preset = preset.replace(first_arm_angle=RNG.uniform(-3, 3))
    stated = preset.as_mapping().items()
    lines = [f"{key} = {json.dumps(value)}" for key, value in stated]
    Path("mine.toml").write_text("\n".join(lines))
    write = ("vehicles", "mine.toml", "--output", "model.xml")
    assert run(*write).out.endswith("wrote model.xml\n")
    assert run(*write).code == 2  # it exists
    text = Path("model.xml").read_text()
    assert 'timestep="0.001"' in text
    body = '<body name="vehicle"'
    Path("model.xml").write_text(text.replace(body, f'{body} euler="0.3 0.2 0.5"'))
    model = read_description("model.xml")
    again = gg.Vehicle(**model.constants)
    sizes = "mass inertia arm_length drag_to_thrust first_arm_angle rotor_height rotor_lag gravity max_tilt"
    for name in sizes.split():
        before, after = (getattr(vehicle, name) or 0 for vehicle in (preset, again))
        # Places are rounded to a micrometre.
        np.testing.assert_allclose(after, before, rtol=1e-5, atol=1e-5, err_msg=name)
    assert again.first_rotor_spin == preset.first_rotor_spin
    alpha = RNG.uniform(-1, 1, (20, 4))
    expected = Geometry.of_vehicle(preset).level_matrix(alpha)
    np.testing.assert_allclose(model.geometry.level_matrix(alpha), expected, atol=1e-9)


# -- PX4

QUAD = {(0.15, 0.15): 0.05, (-0.15, -0.15): 0.05}
QUAD |= {(0.15, -0.15): -0.05, (-0.15, 0.15): -0.05}
SIX = QUAD | {(0.3, 0): 0.05, (-0.3, 0): -0.05}


def parameters(
    places: dict[tuple[float, float], float], toward: Sequence[float], **more: float
) -> str:
    """Return parameters as QGroundControl saves them; `toward` are the tilt directions [°]."""
    stated = {"CA_ROTOR_COUNT": len(places), "CA_SV_TL_COUNT": len(toward)} | more
    for k, ((x, y), drag) in enumerate(places.items()):
        rotor = {"PX": x, "PY": y, "PZ": -0.02, "KM": drag}
        if k < len(toward):
            rotor["TILT"] = k + 1
            stated = {f"CA_SV_TL{k}_TD": toward[k], f"CA_SV_TL{k}_MINA": -60} | stated
        stated = {
            f"CA_ROTOR{k}_{name}": value for name, value in rotor.items()
        } | stated
    lines = [f"1\t1\t{name}\t{value}\t9" for name, value in stated.items()]
    return "\n".join(["# Onboard parameters", *lines])


def test_px4_geometry_is_that_of_its_source(tmp_path: Path) -> None:
    """ActuatorEffectivenessRotors::tiltedAxis and computeEffectivenessMatrix, per thrust."""
    places = {(x, y): drag for x, y, drag in RNG.normal(size=(6, 3)).tolist()}
    toward = [0.0, 90.0, 200.0, 315.0]
    path = tmp_path / "hexa.params"
    path.write_text(parameters(places, toward, CA_ROTOR5_AX=0.3, CA_ROTOR5_AZ=-0.5))
    geometry = read_description(path).geometry
    np.testing.assert_allclose(np.degrees(geometry.tilt_range[:4]), [[-60, 90]] * 4)
    alpha = RNG.uniform(-1, 1, 6)
    forces, moments = geometry.force_matrix(alpha), geometry.moment_matrix(alpha)
    to_ours = np.diag([1.0, -1.0, -1.0])
    for k, ((x, y), drag) in enumerate(places.items()):
        axis = np.array([0.0, 0.0, -1.0])
        if k < 4:
            turned = Rotation.from_euler("ZY", [math.radians(toward[k]), -alpha[k]])
            axis = turned.apply(axis)
        if k == 5:
            axis = np.array([0.3, 0, -0.5]) / math.hypot(0.3, 0.5)
        moment = np.cross([x, y, -0.02], axis) - drag * axis
        np.testing.assert_allclose(forces[:, k], to_ours @ axis, atol=1e-11)
        np.testing.assert_allclose(moments[:, k], to_ours @ moment, atol=1e-11)


def test_px4_quadrotor_is_a_vehicle(run: Any) -> None:
    """Rotors 1, 3, 2, 4 of the file; the axis of rotor 4 points inward."""
    most = {"CA_SV_TL0_MAXA": 60, "CA_SV_TL3_MAXA": 45}
    Path("x.params").write_text(parameters(QUAD, [135, 315, 45, 45], **most))
    printed = run("vehicles", "--from", "x.params")
    assert printed.code == 0
    assert "rotors 1, 3, 2, 4 of the file" in printed.out
    assert "tilt axes of rotors 4 of the file point inward" in printed.out
    Path("one.csv").write_text("alpha1,alpha2,alpha3,alpha4\n0,0,0,0\n")
    judged = run("validate", "one.csv", "--vehicle", "x.params")
    assert "signed as in the file" in judged.err
    assert "rotors 1, 3, 2, 4 of the file" in judged.err
    Path("x.toml").write_text(printed.out)
    vehicle = vehicle_named("x.toml")
    assert vehicle.first_rotor_spin == "counterclockwise"
    assert vehicle.first_arm_angle == pytest.approx(-math.pi / 4)
    assert vehicle.rotor_height == pytest.approx(0.02)
    ranges = np.degrees(np.array(vehicle.tilt_range))
    expected = [[-60, 60], [-60, 90], [-60, 90], [-45, 60]]
    assert ranges == pytest.approx(np.array(expected))


@pytest.mark.parametrize(
    ("places", "toward", "reason"),
    [
        (SIX, [135, 315, 45, 225], "it has 6 rotors"),
        (QUAD, [135, 315], "not every rotor tilts"),
    ],
)
def test_where_the_method_does_not_fit_the_geometry_is_printed(
    run: Any, places: Any, toward: Any, reason: str
) -> None:
    Path("x.params").write_text(parameters(places, toward))
    printed = run("vehicles", "--from", "x.params")
    assert printed.code == 1
    assert reason in printed.out
    assert "-0.0," not in printed.out
    assert reason in run("vehicles", "--from", "x.params", "--json").json["reasons"][0]
    mine = geometry_from_mapping(tomllib.loads(printed.out))
    theirs = read_description("x.params").geometry
    for field in ("position", "tilt_axis", "tilt_range", "moment_ratio"):
        assert np.array_equal(getattr(mine, field), getattr(theirs, field))
    Path("x.toml").write_text(printed.out)
    assert run("plan", "--waypoint", "0,0", "--vehicle", "x.toml").code == 2


FRAMES: dict[str, dict[str, float]] = {
    "symmetric": {},
    "a height and a drag": {"CA_ROTOR2_PZ": 0.1, "CA_ROTOR2_KM": 0.03},
    "spins": {"CA_ROTOR2_KM": -0.06},
    "a tilt axis": {"CA_SV_TL0_TD": 40},
}


@pytest.mark.parametrize("name", FRAMES)
def test_any_frame_is_stated_by_its_places(run: Any, name: str) -> None:
    places = {(0.2, -0.1): -0.06, (-0.2, 0.1): -0.06}
    places |= {(0.2, 0.1): 0.05, (-0.2, -0.1): 0.05}
    # The servos tilt about the lines from the centre, which are not diagonals of a square.
    ahead = math.degrees(math.atan2(0.1, 0.2))
    toward = [90 - ahead, 270 - ahead, 90 + ahead, 270 + ahead]
    Path("x.params").write_text(parameters(places, toward, **FRAMES[name]))
    printed = run("vehicles", "--from", "x.params")
    assert printed.code == 0, printed.out
    Path("x.toml").write_text(printed.out)
    vehicle = vehicle_named("x.toml")
    assert (vehicle.asymmetry is None) == (name == "symmetric")
    assert (vehicle.spins is not None) == (name == "spins")
    assert vehicle.has_own_axes == (name == "a tilt axis")
    theirs = read_description("x.params").geometry
    mine = Geometry.of_vehicle(vehicle)
    off = np.abs(mine.position[:, None] - theirs.position).sum(axis=-1)
    order = off.argmin(axis=1)
    assert off.min(axis=1) == pytest.approx(0, abs=1e-9)
    assert order[0] == 0
    np.testing.assert_allclose(mine.moment_ratio, theirs.moment_ratio[order])
    # The same tilt table, in the order and sense of each, is the same matrix.
    alpha = RNG.uniform(-1, 1, 4)
    sense = np.sign(np.sum(mine.tilt_axis * theirs.tilt_axis[order], axis=1))
    of_file = np.empty(4)
    of_file[order] = sense * alpha
    least = mine.least_singular_value(alpha)
    assert theirs.least_singular_value(of_file) == pytest.approx(least, abs=1e-6)


# -- Tilt tables


def test_a_table_of_six_rotors(run: Any) -> None:
    places = {}
    for k, turn in enumerate(np.radians([0, 180, 60, 240, 120, 300]).tolist()):
        places[0.3 * math.cos(turn), 0.3 * math.sin(turn)] = 0.05 * (-1) ** k
    Path("six.params").write_text(parameters(places, [90, 270, 150, 330]))
    rows = "alpha1,alpha2,alpha3,alpha4_deg,note\n0,0,0,0,a\n0.1,0.1,-0.1,-6,b\n"
    Path("six.csv").write_text(rows)
    good = run("validate", "six.csv", "--vehicle", "six.params", "--json")
    geometry = read_description("six.params").geometry
    last = np.array([0.1, 0.1, -0.1, math.radians(-6), 0, 0])
    between = geometry.least_singular_value(np.linspace(0, 1, 999)[:, None] * last)
    assert good.code == 0
    checks = {check["name"]: check for check in good.json["checks"]}
    least = checks["least_singular_value"]["value"]
    assert least == pytest.approx(between.min(), abs=3e-4)
    assert [good.json[name] for name in ("valid", "two_color", "flyable")] == [
        None,
        None,
        True,
    ]
    beyond = validate_geometry([0 * last, 15 * last], geometry)
    assert not beyond
    assert (beyond.checks[-1].name, beyond.checks[-1].ok) == ("tilt_range", False)


@pytest.mark.parametrize(("most", "flyable"), [(4000, True), (1, None)])
def test_hover_thrusts_of_six_rotors(
    monkeypatch: pytest.MonkeyPatch, most: int, flyable: bool | None
) -> None:
    """The thrusts of least norm reach 0 between these rows; others are all above 0.058 everywhere."""
    monkeypatch.setattr("gaitgraph.invertibility.geometry._MOST_PROGRAMS", most)
    turns = [k * math.pi / 3 for k in range(6)]
    arms = [[0.3 * math.cos(turn), 0.3 * math.sin(turn), 0.02] for turn in turns]
    rotors = [
        {
            "position": [x, y, z],
            "moment_ratio": 0.02 * (-1) ** k,
            "tilt_axis": [x, y, 0],
        }
        for k, (x, y, z) in enumerate(arms)
    ]
    report = validate_geometry(
        [[0.0] * 6, [-0.3, 0.5, -0.9, -0.1, -0.3, 0]],
        geometry_from_mapping({"rotor": rotors}),
    )
    assert report.flyable is flyable
    assert ("Flyable: undecided" in str(report)) == (flyable is None) == (not report)
    value = report.checks[1].value or 0.0
    assert value == pytest.approx(0.0587, abs=1e-3) or not report


def test_a_list_of_four_rotors_is_printed_as_a_vehicle_that_plans(run: Any) -> None:
    lines = []
    for x, y, ratio in ((15, 20, -1), (-15, 24, 1), (-15, -24, -1), (15, -20, 1)):
        lines += ["[[rotor]]", f"position = [{x / 100}, {y / 100}, 0.0]"]
        lines += [f"tilt_axis = [{x}, {y}, 0]", f"moment_ratio = {ratio * 0.016}"]
    lines.append('tilt_range = ["-60deg", "60deg"]')  # of the last one alone
    Path("rotors.toml").write_text("\n".join(lines))
    plan = ("plan", "--waypoint=-0.3,0.3", "--waypoint=-0.6,0.5", "--vehicle")
    for file, advice in (("rotors.toml", "FILE"), ("robot.urdf", "robot.urdf")):
        refused = run(*plan, file)
        assert refused.code == 2
        assert f"vehicles --from {advice} prints" in refused.err
    Path("four.toml").write_text(run("vehicles", "--from", "rotors.toml").out)
    assert run(*plan, "four.toml").code == 0
    ranges: Any = gg.vehicle_named("four.toml").tilt_range
    assert ranges[3] == pytest.approx((-math.pi / 3, math.pi / 3))
    assert ranges[0][1] > 3.14


def test_a_singular_matrix_between_rows_is_found() -> None:
    rows = [[0.0] * 4, [1.0, -1.0, 1.0, -1.0]]
    crossing = validate_geometry(rows, Geometry.of_vehicle(gg.PAPER))
    assert not crossing.flyable
    assert "row 1 and" in str(crossing)
    assert (crossing.checks[0].value or 0.0) < 1e-3


def test_an_error_of_our_own_code_is_not_called_an_error_of_the_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(*_: object) -> None:
        raise ValueError("ours")

    path = tmp_path / "good.urdf"
    path.write_text(urdf(4))
    monkeypatch.setattr("gaitgraph.flight.vehicle_files._number", wrong)
    with pytest.raises(ValueError, match=r"^ours$"):
        read_description(path)


GOOD = parameters(QUAD, [135, 315, 45, 225])
FILES = {
    "text.xml": "no XML at all",
    "broken.urdf": "<robot><link",
    "armless.urdf": urdf(0),
    "zero.urdf": urdf(low=0, high=0),
    "nan.params": GOOD.replace("CA_SV_TL0_MINA\t-60", "CA_SV_TL0_MINA\tnan"),
    "comma.params": GOOD.replace("CA_ROTOR0_PX\t0.15", "CA_ROTOR0_PX\t0,15"),
    "equals.params": "CA_ROTOR_COUNT = 4",
    "empty.urdf": urdf(low=1, high=-1),
    "good.params": GOOD,
    "none.params": "1 1 CA_ROTOR0_PX 0.1 9",
    "light.toml": "drag_ratio = 0.2",
    "five.csv": "alpha1,alpha2,alpha3\n0,0,0\n",
    "four.csv": "alpha1,alpha2,alpha3,alpha4\n0,0,0,0\n",
    "still.toml": "[[rotor]]\nposition = [1, 0, 0]\nmoment_ratio = 0.1",
    "bad.toml": "[[rotor]]\nposition = [1, 0]\nmoment_ratio = 0.1",
}


@pytest.mark.parametrize(
    ("command", "message"),
    cases("""
vehicles --from no.urdf | file 'no.urdf' cannot be read
vehicles --from text.xml | file 'text.xml': it must be URDF (<robot>), MJCF (<mujoco>), parameters of PX4
vehicles --from broken.urdf | file 'broken.urdf': the physics engine cannot read it (
vehicles --from armless.urdf | it must have arms
vehicles --from empty.urdf | tilt range of rotor 1 must be two increasing angles, got 1, -1
vehicles --from zero.urdf | tilt range of rotor 1 must be two increasing angles, got 0, 0
vehicles --from nan.params | CA_SV_TL0_MINA must be a finite number, got 'nan'
vehicles --from comma.params | CA_ROTOR0_PX must be a finite number, got '0,15'
vehicles --from equals.params | CA_ROTOR_COUNT must be a finite number, got '='
vehicles --from none.params | CA_ROTOR_COUNT must be the number of rotors, got 0
vehicles --from good.params --output x.xml | cannot be combined
vehicles --output x.xml | --output must be a file .xml, with the name of one vehicle
vehicles paper --output x.urdf | --output must be a file .xml
vehicles light.toml --output x.xml | states no mass
validate gait3 --vehicle good.params --coefficients exact | --coefficients must be omitted for rotors
validate four.csv --vehicle good.params --require valid | --require must be flyable for rotors of any geometry
validate gait4 --vehicle good.params | --vehicle with rotors must be given with a table of rows, got gait4
validate five.csv --vehicle good.params | column 'alpha4' is missing; columns must be alpha1
validate four.csv --vehicle still.toml | tilt_axis must be other than zero for at least one rotor
validate four.csv --vehicle bad.toml | vehicle file 'bad.toml': position must be numbers within ±1000
"""),
)
def test_bad_input_is_one_line(run: Any, command: str, message: str) -> None:
    for name, text in FILES.items():
        Path(name).write_text(text)
    result = run(*shlex.split(command))
    *warnings, problem = result.err.splitlines()
    assert (result.code, result.out) == (2, "")
    assert all("signed as in the file" in warning for warning in warnings)
    assert message in problem

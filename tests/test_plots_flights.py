"""Pictures of flights: plots over time and films; and maps of basins."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from scipy.spatial.transform import Rotation

import gaitgraph as gg
from gaitgraph.errors import OutputExists
from gaitgraph.flight.basins import Basin, basins_of
from gaitgraph.flight.engine import quaternions
from gaitgraph.flight.flight import OUTCOMES, Flight, FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.plots import films
from gaitgraph.plots.films import flight_view
from gaitgraph.plots.flights import PANELS, plot_flight, write_basins, write_flight
from gaitgraph.plots.gaits import OUTCOME_LOOKS, basin_map
from gaitgraph.plots.vehicles import DEFAULT_VIEW, screen_axes
from gaitgraph.vehicle import PAPER
from tests.samples import gait_of_paper

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def levelling() -> Flight:
    settings = FlightSettings(duration=0.5)
    return fly(gait_of_paper(3).parametrize(1.0), settings=settings)


@pytest.fixture(scope="module")
def circling() -> Flight:
    settings = FlightSettings(
        reference="circle",
        size=0.3,
        lap=1.0,
        duration=1.2,
    )
    timed = gait_of_paper(4).parametrize(1.0)
    return fly(timed, attitude=(0.2, -0.1), settings=settings)


def curves_of(ax: Any) -> dict[str, Any]:
    return {str(line.get_label()): line.get_ydata() for line in ax.get_lines()}


def test_a_plot_shows_what_was_flown(levelling: Flight) -> None:
    axes = dict(zip(PANELS, plot_flight(levelling), strict=True))
    curves = {name: curves_of(ax) for name, ax in axes.items()}
    roll = curves["attitude"]["roll"]
    assert roll == pytest.approx(np.degrees(levelling.column("roll")))
    assert {"$x$, free", "$y$, free", "$z$"} <= curves["place"].keys()
    largest = max(curves["thrusts"][f"rotor {k}"].max() for k in (1, 2, 3, 4))
    assert largest == pytest.approx(levelling.peak_thrust_share)
    tilt = curves["tilts"][r"$\alpha_2$"]
    assert tilt == pytest.approx(np.degrees(levelling.alpha[:, 1]))
    near = curves["singular_value"]
    value = near["least singular value"]
    assert np.min(value) == pytest.approx(levelling.least_singular_value, rel=1e-3)
    assert (near["the controller's lower bound"] <= value * (1 + 1e-9)).all()
    assert near["flight stops below 0.01"] == [0.01, 0.01]
    assert axes["attitude"].get_title().splitlines() == [
        "Gait 3 · vehicle paper · T = 1 s · from roll 17.2°, pitch −11.5°",
        "settled after 0.44 s",
    ]


def test_a_plot_of_a_reference_shows_what_is_wanted(circling: Flight) -> None:
    (ax,) = plot_flight(circling, panels=["place"])
    assert "· circle of 0.3 m in 1 s ·" in ax.get_title()
    wanted = ax.get_lines()[0]
    assert wanted.get_label() == "asked for"
    assert wanted.get_ydata() == pytest.approx(circling.column("x_wanted"))


def test_a_plot_of_a_course_names_its_phases() -> None:
    course = gg.flight.from_hover(gait_of_paper(4).parametrize(1.0), periods=1)
    flight = fly(course, settings=FlightSettings(control_rate=250.0))
    attitude, tilts = plot_flight(flight, panels=["attitude", "tilts"])
    phases = ["hover", "entry", "gait", "exit", "hover"]
    assert [text.get_text().strip() for text in attitude.texts] == phases
    assert not tilts.texts
    assert "entered from hover" in attitude.get_title()


def test_a_plot_marks_a_stop() -> None:
    settings = FlightSettings(floor=0.0, duration=2.5, control_rate=250)
    timed = gait_of_paper(1).parametrize(5.0)
    stopped = fly(timed, anyway=True, settings=settings)
    attitude, thrusts = plot_flight(stopped, panels=["attitude", "thrusts"])
    (mark,) = (line for line in attitude.get_lines() if line.get_gid() == "stop")
    assert thrusts.get_yscale() == "symlog"
    assert stopped.failed
    assert mark.get_xdata()[0] == stopped.flown


def test_a_plot_writes_why_nothing_was_flown() -> None:
    refused = fly(gait_of_paper(1).parametrize(5.0))
    axes = plot_flight(refused, axes=Figure().subplots(2), panels=["thrusts", "tilts"])
    assert axes[0].get_xlim() == (0.0, 5.0)  # a period
    assert "nothing flown" in [text.get_text() for text in axes[0].texts]
    assert "refused before take-off: sign of R" in axes[0].get_title()
    for panels in (["tilt"], ["place"]):  # one is unknown, one is too few
        with pytest.raises(gg.InputError):
            plot_flight(refused, axes=axes, panels=panels)


def test_files_of_a_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same flight gives the same bytes; a film lasts as long as the flight and says at its end how it ended."""
    monkeypatch.setattr(films, "_PAUSE", 2)
    monkeypatch.setattr(films, "_FEWEST", 2)
    flight = fly("gait3", settings=FlightSettings(duration=0.08))
    paths = [tmp_path / "a.gif", tmp_path / "b.gif"]
    write_flight(flight, paths)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    lasts = 0
    with Image.open(paths[0]) as film:
        assert b'"made_by": "fly"' in film.info["comment"]
        count = film.n_frames  # type: ignore[attr-defined]
        for k in range(count):
            film.seek(k)
            lasts += film.info["duration"]
            verdict = np.asarray(film.convert("L"))[285:303, 16:140]
            assert (verdict.min() < 100) == (k == count - 1)
    assert lasts == 80 + 80
    write_flight(flight, [tmp_path / "a.svg"])
    assert "Gait 3 · vehicle paper" in (tmp_path / "a.svg").read_text()
    with pytest.raises(gg.InputError, match="nothing was flown"):
        write_flight(fly("gait1"), [tmp_path / "no.gif"])


def test_a_flight_is_a_bag_with_the_pose_of_the_body(
    tmp_path: Path, levelling: Flight
) -> None:
    pytest.importorskip("rosbags", reason="install gaitgraph[ros]")
    from tests.test_ros import messages_of

    path = tmp_path / "flight.mcap"
    levelling.write(path)
    poses = [message for _, message in messages_of(path, "/pose")]
    joints = [message.position for _, message in messages_of(path, "/joint_states")]
    x = [message.pose.position.x for message in poses]
    turns = [message.pose.orientation for message in poses]
    found = np.array([[turn.w, turn.x, turn.y, turn.z] for turn in turns])
    angles = (levelling.column(name) for name in ("roll", "pitch", "yaw"))
    np.testing.assert_array_equal(x, levelling.column("x"))
    np.testing.assert_array_equal(joints, levelling.alpha)
    cosines = np.sum(found * quaternions(*angles), axis=1)
    assert np.abs(cosines) == pytest.approx(1.0)
    with pytest.raises(OutputExists, match=re.escape("flight.mcap' exists")):
        levelling.write(path)


def test_the_drawn_vehicle_has_the_bodys_attitude(circling: Flight) -> None:
    """Arms, discs and thrusts lie where a camera that does not turn has them."""
    camera = np.stack(screen_axes(DEFAULT_VIEW))
    bearings = np.array(PAPER.arm_angles)
    ends = np.stack([np.cos(bearings), np.sin(bearings), 0 * bearings], axis=1)
    quarter = (PAPER.mass or 0) * PAPER.gravity / 4
    for row in (0, 400, 777):
        seen = flight_view(circling, row)
        roll, pitch, yaw = circling.rows[row, 4:7]
        turned = camera @ Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
        assert seen.arms == pytest.approx(ends @ turned.T)
        assert seen.nose == pytest.approx(0.34 * turned[:, 0])
        # Lines of thrust: along the tilted axes, as long as the thrusts.
        tilts = Rotation.from_rotvec(circling.alpha[row, :, None] * ends)
        shares = np.clip(circling.thrusts[row] / quarter, -2.4, 2.4)
        pushed = 0.62 * shares[:, None] * tilts.apply([0, 0, 1]) @ turned.T
        assert seen.tips - seen.centres == pytest.approx(pushed)


@pytest.fixture(scope="module")
def basin() -> Basin:
    timed = gait_of_paper(3).parametrize(1.0)
    return basins_of(timed, bias=0.8, resolution=3, begins=2)[0]


def test_the_map_marks_each_outcome_with_a_shape_of_its_own(basin: Basin) -> None:
    assert tuple(OUTCOME_LOOKS) == OUTCOMES  # codes count them
    shapes = {marker for marker, _ in OUTCOME_LOOKS.values()}
    assert len(shapes) == len(OUTCOMES)
    ax = basin_map(basin, name="Gait 3")
    marks = [line for line in ax.lines if line.get_gid() == "outcome"]
    assert sum(np.size(mark.get_xdata()) for mark in marks) == 9
    (settled,) = (mark for mark in marks if mark.get_marker() == "o")
    expected = basin.angles[np.argwhere(basin.settled)]
    assert np.asarray(settled.get_xydata()) == pytest.approx(expected)
    assert "Gait 3" in ax.get_title()


def test_files_of_basins_have_a_row_for_each_flight(
    basin: Basin, tmp_path: Path
) -> None:
    table = tmp_path / "basin.csv"
    write_basins([basin, basin], [table, tmp_path / "basin.svg"])
    rows = [line.split(",") for line in table.read_text().splitlines()]
    outcome = rows[0].index("outcome")
    assert [row[outcome] for row in rows[1:]] == 2 * list(basin.columns["outcome"])

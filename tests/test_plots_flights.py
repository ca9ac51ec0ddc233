"""Pictures of flights: plots over time and films; and maps of basins."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from scipy.linalg import expm

import gaitgraph as gg
from gaitgraph.errors import OutputExists
from gaitgraph.flight.basins import Basin, basins_of
from gaitgraph.flight.engine import quaternions
from gaitgraph.flight.flight import OUTCOMES, Flight, FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.plots.films import flight_view
from gaitgraph.plots.flights import plot_flight, write_basins, write_flight
from gaitgraph.plots.gaits import OUTCOME_LOOKS, basin_map
from gaitgraph.plots.vehicles import DEFAULT_VIEW, screen_axes
from gaitgraph.vehicle import PAPER
from tests.samples import gait_of_paper

if TYPE_CHECKING:
    from pathlib import Path

SHORT = FlightSettings(duration=0.5)


@pytest.fixture(scope="module")
def levelling() -> Flight:
    return fly(gait_of_paper(3).parametrize(1.0), settings=SHORT)


@pytest.fixture(scope="module")
def circling() -> Flight:
    settings = FlightSettings(reference="circle", size=0.3, lap=1.0, duration=1.2)
    return fly(
        gait_of_paper(4).parametrize(1.0), attitude=(0.2, -0.1), settings=settings
    )


def test_a_plot_shows_what_was_flown(levelling: Flight, circling: Flight) -> None:
    attitude, place, thrusts, tilts, near = plot_flight(levelling)
    lines = {line.get_label(): line for line in attitude.get_lines()}
    np.testing.assert_allclose(
        lines["roll"].get_ydata(), np.degrees(levelling.column("roll"))
    )
    assert {"$x$, free", "$y$, free", "$z$"} <= {
        line.get_label() for line in place.get_lines()
    }
    shares = [
        line.get_ydata()
        for line in thrusts.get_lines()
        if str(line.get_label()).startswith("rotor")
    ]
    assert np.max(shares) == pytest.approx(levelling.peak_thrust_share)
    assert len(tilts.get_lines()) == 4
    assert near.get_yscale() == "log"
    value, bound, floor = near.get_lines()
    assert np.min(value.get_ydata()) == pytest.approx(
        levelling.least_singular_value, rel=1e-3
    )
    assert np.all(
        np.asarray(bound.get_ydata()) <= np.asarray(value.get_ydata()) * (1 + 1e-9)
    )
    assert (floor.get_ydata()[0], attitude.get_ylabel()) == (0.01, "body attitude (°)")
    assert attitude.get_title().splitlines() == [
        "Gait 3 · vehicle paper · T = 1 s · from roll 17.2°, pitch −11.5°",
        "settled after 0.44 s",
    ]
    assert not [line for line in attitude.get_lines() if line.get_gid() == "stop"]
    (wanted,) = plot_flight(circling, panels=["place"])
    assert "· circle of 0.3 m in 1 s ·" in wanted.get_title()
    assert wanted.get_lines()[0].get_label() == "asked for"
    np.testing.assert_allclose(
        wanted.get_lines()[0].get_ydata(), circling.column("x_wanted")
    )


def test_a_plot_marks_a_stop_and_writes_why_nothing_was_flown() -> None:
    settings = FlightSettings(floor=0.0, duration=2.5, control_rate=250)
    stopped = fly(gait_of_paper(1).parametrize(1.0), anyway=True, settings=settings)
    assert stopped.failed
    marks = [
        line for line in plot_flight(stopped)[0].get_lines() if line.get_gid() == "stop"
    ]
    assert marks[0].get_xdata()[0] == stopped.flown
    refused = fly(gait_of_paper(1).parametrize(5.0))
    axes = plot_flight(refused, axes=Figure().subplots(2), panels=["thrusts", "tilts"])
    assert axes[0].get_xlim() == (
        0.0,
        5.0,
    )  # a period, although that is longer than three seconds
    assert "nothing flown" in [text.get_text() for text in axes[0].texts]
    assert "refused before take-off: sign of R" in axes[0].get_title()
    for panels, said in (
        (["tilt"], "did you mean 'tilts'?"),
        (["place"], "axes must be 1, one a panel"),
    ):
        with pytest.raises(gg.InputError, match=re.escape(said)):
            plot_flight(refused, axes=axes, panels=panels)


def test_files_of_a_flight(tmp_path: Path, levelling: Flight) -> None:
    """The same flight gives the same bytes; a film lasts as long as the flight and says at its end how it ended."""
    again = fly(gait_of_paper(3).parametrize(1.0), settings=SHORT)
    names = ("a.svg", "a.gif")
    for folder, flight in (("one", levelling), ("two", again)):
        (tmp_path / folder).mkdir()
        write_flight(flight, [tmp_path / folder / name for name in names])
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (
            tmp_path / "two" / name
        ).read_bytes()
    with Image.open(tmp_path / "one" / "a.gif") as film:
        assert film.size == (480, 420)
        assert b'"made_by": "fly"' in film.info["comment"]
        lasts, verdicts = [], []
        for k in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(k)
            lasts.append(film.info["duration"])
            verdicts.append(np.asarray(film.convert("L"))[285:303, 16:140].min() < 100)
    assert sum(lasts) == 480 + 800
    assert verdicts == [False] * (len(lasts) - 1) + [True]
    with pytest.raises(gg.InputError, match="nothing was flown"):
        write_flight(fly(gait_of_paper(1).parametrize(1.0)), [tmp_path / "no.gif"])


def test_a_flight_is_a_bag_with_the_pose_of_the_body(
    tmp_path: Path, levelling: Flight
) -> None:
    pytest.importorskip("rosbags", reason="install gaitgraph[ros]")
    from tests.test_ros import messages_of

    path = tmp_path / "flight.mcap"
    levelling.write(path)
    table = levelling.table
    poses = [message.pose for _, message in messages_of(path, "/pose")]
    places = [[one.position.x, one.position.y, one.position.z] for one in poses]
    expected = np.column_stack([table[name] for name in "xyz"])
    np.testing.assert_array_equal(places, expected)
    turns = [one.orientation for one in poses]
    found = np.array([[one.w, one.x, one.y, one.z] for one in turns])
    wanted = quaternions(table["roll"], table["pitch"], table["yaw"])
    off = np.abs((found * wanted).sum(axis=1)) - 1.0
    np.testing.assert_allclose(off, 0.0, atol=1e-12)
    joints = [message.position for _, message in messages_of(path, "/joint_states")]
    np.testing.assert_array_equal(joints, table.alpha)
    stamps = [message.header.stamp for _, message in messages_of(path, "/pose")]
    assert (stamps[0].sec, stamps[0].nanosec) == (1, 0)
    with pytest.raises(gg.errors.OutputExists, match="flight.mcap' exists"):
        levelling.write(path)
    levelling.write(path, force=True)


def test_the_drawn_vehicle_has_the_bodys_attitude(circling: Flight) -> None:
    """Arms, discs and thrusts lie where a camera that does not turn has them."""
    camera = np.stack(screen_axes(DEFAULT_VIEW))
    bearings = PAPER.first_arm_angle + np.arange(4) * np.pi / 2
    ends = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(4)])
    for row in (0, 400, 777):
        seen = flight_view(circling, row)
        turns = zip(("yaw", "pitch", "roll"), np.eye(3)[::-1], strict=True)
        by_axis = [
            expm(float(circling.column(name)[row]) * np.cross(np.eye(3), axis))
            for name, axis in turns
        ]
        turned = np.linalg.multi_dot(by_axis)
        np.testing.assert_allclose(seen.arms, (camera @ turned @ ends).T, atol=1e-9)
        np.testing.assert_allclose(
            seen.nose, 0.34 * camera @ turned @ np.array([1.0, 0.0, 0.0]), atol=1e-9
        )
        # Lines of thrust: along the tilted axes, as long as the thrusts.
        alpha = [float(circling.column(f"alpha{k + 1}")[row]) for k in range(4)]
        axes = np.stack(
            [
                np.sin(alpha) * np.sin(bearings),
                -np.sin(alpha) * np.cos(bearings),
                np.cos(alpha),
            ]
        )
        assert PAPER.mass is not None
        weight = PAPER.mass * PAPER.gravity
        shares = np.clip(circling.thrusts[row] / (weight / 4), -2.4, 2.4)
        pushed = seen.tips - seen.centres
        np.testing.assert_allclose(
            pushed, 0.62 * shares[:, None] * (camera @ turned @ axes).T, atol=1e-9
        )


@pytest.fixture(scope="module")
def basin() -> Basin:
    return basins_of(
        gait_of_paper(3).parametrize(1.0), bias=0.8, resolution=3, begins=2
    )[0]


def test_the_map_marks_each_outcome_with_a_shape_of_its_own(basin: Basin) -> None:
    assert tuple(OUTCOME_LOOKS) == OUTCOMES  # codes count them
    assert len({look["marker"] for look in OUTCOME_LOOKS.values()}) == len(OUTCOMES)
    ax = basin_map(basin, name="Gait 3")
    marks = {
        line.get_marker(): np.asarray(line.get_data())
        for line in ax.lines
        if line.get_gid() == "outcome"
    }
    assert sum(places.shape[1] for places in marks.values()) == 9
    drawn = sorted(map(tuple, np.round(marks["o"].T, 9).tolist()))
    grid = [(i, j) for i, j in np.ndindex(3, 3) if basin.settled[i, j]]
    assert drawn == [tuple(np.round(basin.angles[[i, j]], 9).tolist()) for i, j in grid]
    assert "Gait 3" in ax.get_title()
    assert any(patch.get_gid() == "acceptable" for patch in ax.patches)


def test_files_hold_one_row_a_flight(basin: Basin, tmp_path: Path) -> None:
    """What the formats hold is tested with tables."""
    names = [tmp_path / f"basin.{suffix}" for suffix in ("csv", "svg")]
    write_basins([basin, basin], names)
    rows = [line.split(",") for line in names[0].read_text().splitlines()]
    outcome = rows[0].index("outcome")
    assert [row[outcome] for row in rows[1:]] == 2 * list(basin.columns["outcome"])
    with pytest.raises(OutputExists, match="exists"):
        write_basins([basin], names[:1])

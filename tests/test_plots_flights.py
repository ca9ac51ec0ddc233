"""Pictures of flights: plots over time, films, what the engine renders, its viewer; and maps of basins."""

from __future__ import annotations

import csv
import json
import sys
from contextlib import contextmanager
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

import gaitgraph as gg
from gaitgraph.errors import InputError, OutputExists
from gaitgraph.flight.basins import Basin, basins_of
from gaitgraph.flight.engine import quaternion_of, rendered_frames
from gaitgraph.flight.record import COLUMNS, OUTCOMES, Flight
from gaitgraph.flight.settings import FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.gait.paper_gaits import paper_gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.plots.basins import _LOOKS, basin_map, basins_figure
from gaitgraph.plots.flight_films import _clock_of, _Drawing, write_film
from gaitgraph.plots.flight_outputs import write_basins, write_flight
from gaitgraph.plots.flights import flights_side_by_side, name_of_flight, plot_flight
from gaitgraph.plots.gif_films import provenance_of_gif
from gaitgraph.plots.scenes import DEFAULT_VIEW
from gaitgraph.vehicle import PAPER

if TYPE_CHECKING:
    from collections.abc import Iterator

PUBLISHED = coefficients_of(PAPER)
SHORT = FlightSettings(duration=0.5)
CORNERS = [[1.178, -1.178], [1.178, -0.393], [0.393, -0.393], [0.393, -1.178]]


def gait(number: int) -> gg.Gait:
    return paper_gait(number, PAPER, PUBLISHED)


@pytest.fixture(scope="module")
def levelling() -> Flight:
    return fly(gait(3).parametrize(1.0), settings=SHORT)


@pytest.fixture(scope="module")
def circling() -> Flight:
    settings = FlightSettings(reference="circle", size=0.3, lap=1.0, duration=1.2)
    return fly(gait(4).parametrize(1.0), attitude=(0.2, -0.1), settings=settings)


def test_the_pictures_of_the_page_are_small() -> None:
    images = Path(__file__).parent.parent / "docs" / "images"
    assert (images / "flight.gif").stat().st_size < 400_000
    assert (images / "flights.png").stat().st_size < 300_000
    assert '"reference": "circle"' in provenance_of_gif(images / "flight.gif")


WRONG = {
    "a suffix of gaits alone": (["--output", "x.h"], "'x.h' is a C header, which is of gaits alone; allowed for a"),
    "a mistyped suffix": (["--output", "x.cvs"], "did you mean '.csv'?"),
    "no folder": (["--output", "none/x.csv"], "folder 'none' does not exist"),
    "twice": (["--output", "x.png", "--output", "./x.png"], "is named twice"),
    "half an attitude": (["--attitude", "0.3"], "--attitude: '0.3'; allowed is ROLL,PITCH"),
    "an attitude that is none": (["--attitude", "0.3,up"], "--attitude: 'up'"),
    "upside down": (["--attitude", "0,pi/2"], "allowed is a roll from -pi to pi and a pitch between"),
    "unstable damping": (["--attitude-damping", "3000"], "--attitude-damping: 3000.0 is unstable at 1000 Hz; allowed"),
    "an unstable step": (["--step", "0.02", "--control-rate", "50", "--attitude-damping", "99"], "unstable at 50 Hz"),
    "damping that the engine's step hides": (
        ["--step", "0.02", "--control-rate", "50", "--attitude-damping", "0.6"],
        "--attitude-damping: 0.6 is unstable at 50 Hz with attitude_stiffness 100.0; allowed is more than 1",
    ),
    "a short period": (["--period", "0.001"], "period: 0.001 s at a step of 0.001 s; allowed is 20 steps (0.02 s) and"),
    "a long period": (["--period", "2000"], "period: 2000 s, which is flown whole where no duration is stated"),
    "a rate that does not fit": (["--control-rate", "300"], "--control-rate: 300 Hz does not fit steps of 0.001 s"),
    "wind": (["--wind", "a,b"], "--wind: 'a,b'; allowed are two or three numbers"),
    "a lot of wind": (["--wind", "1e3,0"], "--wind: (1000.0, 0.0); allowed"),
    "a reference": (["--reference", "cirle"], "did you mean 'circle'?"),
    "periods of what": (["--periods", "3"], "allowed is with --from-hover"),
    "no periods": (["--from-hover", "--periods", "0"], "gaitgraph: --periods: 0; allowed is a whole number from 1"),
    "bias": (["--bias", "1.5"], "--bias: 1.5; allowed is a number in (0, 1]"),
    "a period with its unit": (["--period", "1s"], "--period: '1s'; allowed is a number of seconds"),
    "a negative period": (["--period", "-1"], "gaitgraph: --period: -1.0; allowed is a finite number of seconds"),
    "half a seed": (["--seed", "1.5"], "--seed: '1.5'; allowed is a whole number"),
    "one wind": (["--wind", "1"], "--wind: '1'; allowed are two or three numbers"),
    "a limit and none": (["--thrust-limit", "5", "--no-saturation"], "--thrust-limit: 5 with --no-saturation; allowed"),
    "an idle size": (["--size", "2"], "--size: 2 with the reference attitude; allowed is with --reference step, line"),
    "an idle lap": (["--reference", "step", "--lap", "2"], "--lap: 2 with the reference step; allowed is with --ref"),
    "an idle gain": (["--position-damping", "2"], "--position-damping: 2 with the reference attitude; allowed is"),
    "no duration": (["--duration", "0"], "--duration: 0.0; allowed is 0.001 to 10000 (s)"),
    "no screen": (["--view"], "--view: no screen here"),
    "no settings": (["--settings", "none.toml"], "settings file: cannot read 'none.toml'"),
    "a law": (["--law", "smoth"], "gaitgraph: --law: 'smoth'; allowed are"),
    "a steep attitude": (["--attitude", "9,9"], "gaitgraph: --attitude: (9.0, 9.0); allowed is a roll"),
    "a vehicle without mass": (["--vehicle", "light.toml"], "vehicle 'light' states no mass (kg), which flight needs"),
    "a vehicle without inertia": (["--vehicle", "dot.toml"], "vehicle 'dot' states no inertia (kg m²), which flight"),
}


# ---------------------------------------------------------------- plots


@pytest.fixture
def no_windows() -> Iterator[None]:
    from matplotlib import pyplot

    pyplot.switch_backend("agg")
    yield
    pyplot.close("all")


@pytest.mark.usefixtures("no_windows")
def test_a_plot_shows_what_was_flown(levelling: Flight, circling: Flight) -> None:
    attitude, place, thrusts, tilts, near = plot_flight(levelling)
    lines = {line.get_label(): line for line in attitude.get_lines()}
    np.testing.assert_allclose(lines["roll"].get_ydata(), np.degrees(levelling.column("roll")))
    assert {"$x$, free", "$y$, free", "$z$"} <= {line.get_label() for line in place.get_lines()}
    shares = [line.get_ydata() for line in thrusts.get_lines() if str(line.get_label()).startswith("rotor")]
    assert np.max(shares) == pytest.approx(levelling.peak_thrust_share)
    assert len(tilts.get_lines()) == 4
    assert near.get_yscale() == "log"
    assert attitude.get_title().splitlines() == [
        "Red gait · vehicle paper · T = 1 s · from roll 17.2°, pitch −11.5°",
        "settled after 0.44 s",
    ]
    assert "· circle of 0.3 m in 1 s ·" in name_of_flight(circling)
    assert plot_flight(levelling, title="Mine")[0].get_title() == "Mine"
    assert not [line for line in attitude.get_lines() if line.get_gid() == "stop"]
    wanted = plot_flight(circling, panels=["place"])[0].get_lines()[0]
    assert wanted.get_label() == "asked for"
    np.testing.assert_allclose(wanted.get_ydata(), circling.column("x_wanted"))


@pytest.mark.usefixtures("no_windows")
def test_a_plot_marks_a_stop_and_writes_why_nothing_was_flown() -> None:
    refused = fly(gait(1).parametrize(1.0))
    stopped = fly(
        gait(1).parametrize(1.0), anyway=True, settings=FlightSettings(floor=0.0, duration=2.5, control_rate=250)
    )
    assert stopped.failed
    axes = flights_side_by_side({"refused": refused, "stopped": stopped, "level": fly(gait(3).parametrize(1.0))})
    assert axes.shape == (3, 3)
    marks = [line for line in axes[0, 1].get_lines() if line.get_gid() == "stop"]
    assert marks[0].get_xdata()[0] == stopped.flown
    assert "nothing flown" in [text.get_text() for text in axes[0, 0].texts]
    assert axes[0, 0].get_title().startswith("refused\nrefused before take-off: sign of R")
    for panels, said in ((["tilt"], "did you mean 'tilts'?"), ([3], "panels: 3; allowed are attitude")):
        with pytest.raises(gg.InputError, match="panels") as wrong:
            plot_flight(refused, panels=panels)  # type: ignore[arg-type]
        assert said in str(wrong.value)
    with pytest.raises(gg.InputError, match="1 of them; allowed are 2"):
        plot_flight(refused, axes=axes[0, 0], panels=["place", "tilts"])
    with pytest.raises(gg.InputError, match="flights: none"):
        flights_side_by_side({})


def test_the_same_flight_gives_the_same_pictures(tmp_path: Path, levelling: Flight) -> None:
    again = fly(gait(3).parametrize(1.0), settings=SHORT)
    for folder, flight in (("one", levelling), ("two", again)):
        (tmp_path / folder).mkdir()
        write_flight(flight, [tmp_path / folder / name for name in ("a.svg", "a.gif")])
    for name in ("a.svg", "a.gif"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


# ---------------------------------------------------------------- films


def test_a_film_lasts_as_long_as_the_flight_and_tells_what_made_it(tmp_path: Path, levelling: Flight) -> None:
    path = tmp_path / "film.gif"
    write_film(levelling, path)
    with Image.open(path) as film:
        lasts = []
        for k in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(k)
            lasts.append(film.info["duration"])
        assert film.size == (480, 420)
    assert sum(lasts) == 500 + 800
    assert '"made_by": "fly"' in provenance_of_gif(path)
    write_film(levelling, tmp_path / "few.gif", frames=3)
    with Image.open(tmp_path / "few.gif") as film:
        assert film.n_frames == 3  # type: ignore[attr-defined]
    for frames in (1, 2.5, True, 10_000):
        with pytest.raises(gg.InputError, match="frames: .*; allowed is a whole number from 2 to 1000"):
            write_film(levelling, tmp_path / "no.gif", frames=frames)  # type: ignore[arg-type]
    with pytest.raises(gg.InputError, match="nothing was flown"):
        write_film(fly(gait(1).parametrize(1.0)), tmp_path / "no.gif")


def test_the_drawn_vehicle_has_the_bodys_attitude(circling: Flight) -> None:
    """Arms, discs and thrusts lie where a camera that does not turn sees them."""
    drawing = _Drawing(circling)
    for row in (0, 400, 777):
        scene = drawing._scene(row)
        w, x, y, z = quaternion_of(*(float(circling.column(name)[row]) for name in ("roll", "pitch", "yaw")))
        turned = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        camera = drawing.scale * np.stack([drawing.right, -drawing.up])
        bearings = PAPER.first_arm_angle + np.arange(4) * np.pi / 2
        ends = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(4)])
        np.testing.assert_allclose(scene.arms - scene.hub, (camera @ turned @ ends).T, atol=1e-9)
        nose = camera @ turned @ np.array([1.0, 0.0, 0.0])
        np.testing.assert_allclose(
            (scene.nose - scene.hub) / np.linalg.norm(scene.nose - scene.hub), nose / np.linalg.norm(nose), atol=1e-9
        )
        # Lines of thrust: along the tilted axes, as long as the thrusts.
        alpha = [float(circling.column(f"alpha{k + 1}")[row]) for k in range(4)]
        axes = np.stack([np.sin(alpha) * np.sin(bearings), -np.sin(alpha) * np.cos(bearings), np.cos(alpha)])
        shares = np.clip(circling.thrusts[row] / drawing.quarter, -2.4, 2.4)
        pushed = scene.thrusts[0] - scene.discs[0, :, 4:]
        np.testing.assert_allclose(pushed, 0.62 * shares[:, None] * (camera @ turned @ axes).T, atol=1e-9)


def test_words_lie_over_the_drawing_and_apart_from_each_other() -> None:
    long = "the decoupling matrix nears singularity at 0.253 s: its least singular value is between 0.009 and 0.018"
    flown = fly(gait(3).parametrize(1.0), attitude=(1.2, -1.0), settings=FlightSettings(duration=0.3))
    drawing = _Drawing(replace(flown, reason=long))
    over, boxes = drawing._over(len(flown.rows) - 1)
    picture = drawing.frame(flown.flown)
    covered = np.zeros((420, 480), dtype=int)
    for left, top, right, bottom in boxes:
        covered[top:bottom, left:right] += 1
        assert picture.crop((left, top, right, bottom)).tobytes() == over.crop((left, top, right, bottom)).tobytes()
    assert covered.max() == 1
    assert boxes[-1][3] - boxes[-1][1] < 45  # two lines, of a text of three
    assert len(drawing._over(0)[1]) == len(boxes) - 1


def test_frames_of_a_long_film_go_through_the_gait() -> None:
    """Every fifth second, a gait of one second would seem to stand still."""

    def times(seconds: float, frames: int | None = None) -> np.ndarray[Any, Any]:
        told = SimpleNamespace(rows=[0], flown=seconds, course=SimpleNamespace(timed=SimpleNamespace(period=1.0)))
        return _clock_of(told, frames)[0]  # type: ignore[arg-type]

    for seconds in (60.0, 500.0):
        found = times(seconds)
        assert np.all(np.diff(found) > 0)
        assert np.abs(found - np.linspace(0.0, seconds, 101)[:-1])[:-1].max() <= 0.5
        phases = np.round(found[:-1] % 1.0, 3) % 1.0
        assert sorted(set(phases.tolist())) == pytest.approx(np.arange(25) / 25)
        assert found[-1] == seconds
    np.testing.assert_allclose(times(5.0, 28)[:-1], np.linspace(0.0, 5.0, 29)[:-2], atol=0.01)


def test_the_engine_renders_what_is_drawn(
    run: Any, tmp_path: Path, levelling: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    try:
        picture = rendered_frames(levelling, [0.0], view=DEFAULT_VIEW)[0].astype(int)
    except gg.InputError as error:
        pytest.skip(str(error))
    # Rotor 1 is the only red thing; it is where the drawing has it, the camera a little nearer or farther.
    red = picture[..., 0] - picture[..., 1:].max(axis=-1) > 40
    centre = np.array([np.nonzero(red)[1].mean(), np.nonzero(red)[0].mean()]) - np.array([240.0, 180.0])
    scene = _Drawing(levelling)._scene(0)
    drawn = (scene.arms[0] + scene.discs[0, 0, 4:]) / 2 - scene.hub
    assert centre @ drawn > 0.95 * np.linalg.norm(centre) * np.linalg.norm(drawn)
    # Where it cannot, nothing is flown, and the message is one line.
    monkeypatch.setattr("subprocess.run", lambda *_, **__: SimpleNamespace(returncode=-11, stdout=b""))
    done = run("fly", "gait3", "--output", "a.gif", "--render")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert "film: the engine cannot render here" in done.err
    assert "no film to render" in run("fly", "gait3", "--output", "a.csv", "--render").err
    turned = [np.roll(picture, 5 * k, axis=1).astype(np.uint8) for k in range(20)]
    monkeypatch.setattr(
        "gaitgraph.plots.flight_films.rendered_frames", lambda _, times, view: np.stack(turned[: len(times)])
    )
    write_flight(levelling, [tmp_path / "b.gif"], rendered=True)
    with Image.open(tmp_path / "b.gif") as film:
        assert film.size == (480, 360)
        assert film.n_frames == 12  # type: ignore[attr-defined]


# ---------------------------------------------------------------- the viewer


def test_the_viewer_shows_the_flight_again(monkeypatch: pytest.MonkeyPatch, levelling: Flight) -> None:
    from gaitgraph.flight.engine import check_screen, show_flight

    seen: list[np.ndarray[Any, Any]] = []
    clock = iter(np.arange(0.0, 10.0, 0.1))

    @contextmanager
    def launched(model: Any, data: Any, **_: Any) -> Iterator[Any]:
        yield SimpleNamespace(
            cam=SimpleNamespace(), is_running=lambda: len(seen) < 7, sync=lambda: seen.append(data.qpos.copy())
        )

    fake = ModuleType("mujoco.viewer")
    fake.launch_passive = launched  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "mujoco.viewer", fake)
    monkeypatch.setattr("mujoco.viewer", fake, raising=False)
    monkeypatch.setattr("gaitgraph.flight.engine.time", SimpleNamespace(monotonic=lambda: next(clock), sleep=id))
    show_flight(levelling)
    np.testing.assert_allclose(seen[0][:3], levelling.rows[100, 1:4])
    np.testing.assert_allclose(seen[-1][7:], levelling.rows[-1, [COLUMNS.index(f"alpha{k}") for k in (1, 2, 3, 4)]])

    def broken(*_: Any, **__: Any) -> None:
        raise RuntimeError("it needs mjpython")

    fake.launch_passive = broken  # type: ignore[attr-defined]
    with pytest.raises(gg.InputError, match="the viewer does not open .it needs mjpython."):
        show_flight(levelling)
    monkeypatch.setenv("DISPLAY", ":987")
    monkeypatch.setattr("subprocess.run", lambda *_, **__: SimpleNamespace(returncode=1))
    with pytest.raises(gg.InputError, match="no window can be opened here"):
        check_screen()


def test_pictures_are_pictures(tmp_path: Path, levelling: Flight) -> None:
    write_flight(levelling, [tmp_path / "a.png", tmp_path / "a.pdf"])
    with Image.open(BytesIO((tmp_path / "a.png").read_bytes())) as picture:
        assert picture.width > 1000
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


# ---------------------------------------------------------------- basins


@pytest.fixture(scope="module")
def basin() -> Basin:
    return basins_of(gait(3).parametrize(1.0), biases=[0.8], resolution=5, begins=2)[0]


def test_the_map_marks_each_outcome_with_a_shape_of_its_own(basin: Basin) -> None:
    assert tuple(_LOOKS) == OUTCOMES  # codes count them
    assert len({look["marker"] for look in _LOOKS.values()}) == len(OUTCOMES)
    ax = basin_map(basin, name="Gait 3")
    marks = {line.get_marker(): np.asarray(line.get_data()) for line in ax.lines if line.get_gid() == "outcome"}
    assert sum(places.shape[1] for places in marks.values()) == 25
    drawn = sorted(map(tuple, np.round(marks["o"].T, 9).tolist()))
    grid = [(i, j) for i, j in np.ndindex(5, 5) if basin.settled[i, j]]
    assert drawn == [tuple(np.round(basin.angles[[i, j]], 9).tolist()) for i, j in grid]
    assert "Gait 3" in ax.get_title()
    assert any(line.get_gid() == "acceptable" for line in ax.lines)
    with pytest.raises(InputError, match="basins: none"):
        basins_figure([])


def test_files_hold_one_row_a_flight(basin: Basin, tmp_path: Path) -> None:

    names = [tmp_path / f"basin.{suffix}" for suffix in ("csv", "json", "npz", "mat", "parquet", "svg")]
    write_basins([basin, basin], names)
    with names[0].open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 100
    assert [row["outcome"] for row in rows[:50]] == list(basin.columns()["outcome"])
    assert json.loads(names[1].read_text())["columns"]["seconds"][:50] == basin.columns()["seconds"].tolist()
    with np.load(names[2]) as arrays:
        assert np.array_equal(arrays["roll"][:50], basin.columns()["roll"])
    parquet = pytest.importorskip("pyarrow.parquet").read_table(names[4])
    assert parquet.column("outcome").to_pylist()[:50] == list(basin.columns()["outcome"])
    before = [name.read_bytes() for name in names]
    write_basins([basin, basin], names, force=True)
    assert [name.read_bytes() for name in names] == before
    with pytest.raises(OutputExists, match="exists"):
        write_basins([basin], names[:1])
    with pytest.raises(InputError, match=r"allowed for a basin are .csv"):
        write_basins([basin], [tmp_path / "basin.gif"])

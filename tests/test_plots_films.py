"""The geometry of a drawn vehicle, and films of gaits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from PIL import Image

import gaitgraph as gg
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.invertibility import control_force_matrix
from gaitgraph.plots import films
from gaitgraph.plots.axes import ROTOR_COLORS
from gaitgraph.plots.films import frames_of, write_films
from gaitgraph.plots.vehicles import FROM_ABOVE, draw_vehicle, vehicle_view
from gaitgraph.timing.timed_gait import table_of
from tests.samples import by_vehicle

X_FRAME = gg.Vehicle(
    name="an <X> & more",
    drag_ratio=0.12,
    first_arm_angle=math.pi / 4,
    first_rotor_spin="counterclockwise",
)
BEHIND, RIGHT = (math.pi, 0.0), (-math.pi / 2, 0.0)
LEVEL = np.zeros(4)


# The vehicle


@by_vehicle(gg.PAPER, X_FRAME)
def test_discs_face_along_the_forces_of_the_rotors(vehicle: gg.Vehicle) -> None:
    """Three views put together are vectors in body axes, in arm lengths."""
    whole = vehicle.replace(
        thrust_coefficient=1.0, arm_length=1.0, drag_coefficient=None
    )
    upward = np.sign(control_force_matrix(LEVEL, whole)[2])
    for alpha in np.random.default_rng(6).uniform(-math.pi, math.pi, (40, 4)):
        centres, rims, tips = vectors_of(alpha, vehicle)
        across, along = rims[:, 0] - centres, rims[:, 18] - centres
        force = (control_force_matrix(alpha, whole) * upward).T
        thrust = tips - centres
        length = np.linalg.norm(thrust, axis=1, keepdims=True)
        assert thrust / length == pytest.approx(force)
        # A disc is round, and turns about its arm.
        assert np.cross(across, along) == pytest.approx(0.25 * force)
        bearings = np.array(vehicle.arm_angles)
        arms = np.stack([np.cos(bearings), np.sin(bearings), LEVEL], axis=1)
        assert across == pytest.approx(0.5 * arms)


def vectors_of(alpha: Any, vehicle: gg.Vehicle) -> list[Any]:
    """Return centres, rims and tips in body axes, from three views."""
    above = vehicle_view(alpha, vehicle, view=FROM_ABOVE)
    behind = vehicle_view(alpha, vehicle, view=BEHIND)
    right = vehicle_view(alpha, vehicle, view=RIGHT)
    vectors = []
    for name in ("centres", "rims", "tips"):
        # From above the screen's right is −y and its up x; from behind right is −y, up z; from the right x and z.
        left, x = np.moveaxis(getattr(above, name), -1, 0)
        same_left, z = np.moveaxis(getattr(behind, name), -1, 0)
        assert same_left == pytest.approx(left)
        assert getattr(right, name) == pytest.approx(np.stack([x, z], axis=-1))
        vectors.append(np.stack([x, -left, z], axis=-1))
    return vectors


def test_a_view_stays_within_its_limits() -> None:
    random = np.random.default_rng(7)
    for _ in range(100):
        alpha = random.uniform(-math.pi, math.pi, 4)
        seen = vehicle_view(alpha, X_FRAME, view=tuple(random.uniform(-3, 1.5, 2)))
        low, high = seen.limits
        for places in (seen.rims, seen.tips, seen.labels, seen.arms, seen.nose):
            assert ((places >= low) & (places <= high)).all()


def test_a_vehicle_from_above_and_from_below() -> None:
    above = vehicle_view(LEVEL, view=FROM_ABOVE)
    forward_up = np.array([[0, 1], [-1, 0], [0, -1], [1, 0]])  # and left left
    assert above.arms == pytest.approx(forward_up)
    assert above.nose == pytest.approx([0.0, 0.34])
    assert above.facing.all()
    assert not vehicle_view(LEVEL, view=(0.0, -1.0)).facing.any()
    behind = vehicle_view(LEVEL, view=(math.pi, 0.5))
    assert (behind.order[0], behind.order[-1]) == (0, 2)  # the forward one is farthest
    pulls = vehicle_view(LEVEL, view=FROM_ABOVE, thrusts=[1.0, -1.0, 1.0, 0.5])
    assert pulls.facing.tolist() == [True, False, True, True]


def test_a_vehicle_is_drawn_as_its_view_says() -> None:
    seen = vehicle_view([1.1, -1.1, 1.1, -1.1])
    ax = Figure().add_subplot()
    draw_vehicle(ax, seen)
    discs: list[Any] = list(ax.patches)  # what is nearer is drawn later
    for disc, rotor in zip(discs, seen.order, strict=True):
        middle = np.asarray(disc.get_xy())[:-1].mean(axis=0)
        assert middle == pytest.approx(seen.centres[rotor], abs=0.01)
        assert to_hex(disc.get_facecolor()) == ROTOR_COLORS[rotor]
    numbers = [text.get_text() for text in ax.texts if text.get_text()]
    assert numbers == ["1", "2", "3", "4"]


# Films


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(films, "_FEWEST", 2)


def duration_of(path: Path) -> int:
    """Return how long a film lasts [ms]."""
    lasts = 0
    with Image.open(path) as image:
        for k in range(image.n_frames):  # type: ignore[attr-defined]
            image.seek(k)
            lasts += image.info["duration"]
    return lasts


@pytest.mark.usefixtures("short")
def test_a_gif_plays_one_period_for_ever_and_states_what_made_it(
    tmp_path: Path,
) -> None:
    table = table_of(gg.gait_of("gait3").parametrize(0.2))
    film, again = tmp_path / "gait.gif", tmp_path / "again.gif"
    write_films(table, [film, again])
    assert film.read_bytes() == again.read_bytes()
    assert duration_of(film) == 200
    with Image.open(film) as image:
        assert (image.size, image.info["loop"]) == ((480, 420), 0)
        assert image.info["comment"].decode() == provenance_text(table)
        pixels = np.asarray(image.convert("RGB")) / 255
    for color in ROTOR_COLORS:
        off = np.abs(pixels - to_rgb(color)).max(axis=-1)
        assert (off <= 0.05).sum() > 300


@pytest.mark.parametrize(
    ("period", "count"),
    [
        (1e-6, 10),
        (0.4, 10),
        (0.5, 12),
        (0.52, 13),
        (1.234, 31),
        (60.0, 1500),
        (1e9, 1500),
    ],
)
def test_a_film_has_25_frames_a_second_and_lasts_from_0_4_s_to_a_minute(
    period: float, count: int
) -> None:
    assert frames_of(period) == count
    told = films._speed(period)
    assert ("slower" in told) is (period < 0.4)
    assert ("faster" in told) is (period > 60)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(("rows", "lasts"), [(30, 500), (1, 1000)])
def test_films_of_other_tables(
    rows: int, lasts: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Uneven times and a hostile name; a single row lasts a second."""
    monkeypatch.setattr(films, "RATE", 4)
    columns = {f"alpha{k}": np.linspace(-1.5, 1.5, rows) for k in (1, 2, 3, 4)}
    if rows > 1:
        columns["t"] = 1e-3 * np.linspace(0, 1, rows) ** 2
    about = {"vehicle": X_FRAME.as_mapping(), "coefficients": "exact"}
    write_films(Table(columns=columns, about=about), [tmp_path / "a.gif"])
    assert duration_of(tmp_path / "a.gif") == lasts


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("a.svg", "must be .gif or .mp4"),
        ("taken.gif", "'taken.gif' exists"),
        ("a.mp4", "MP4 needs the program ffmpeg"),
    ],
)
def test_films_that_cannot_be_written_are_refused(
    name: str, reason: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(FFMpegWriter, "isAvailable", lambda: False)
    Path("taken.gif").write_text("mine")
    with pytest.raises(gg.GaitgraphError, match=reason):
        write_films("gait3", [name])
    assert Path("taken.gif").read_text() == "mine"


@pytest.mark.usefixtures("short")
def test_the_command_and_timed_gaits_write_films(run: Any) -> None:
    done = run("export", "gait4", "a.gif", "a.json", "--period", "0.08")
    assert done.out.splitlines()[0] == "wrote a.gif: one period, drawn"
    gg.gait_of("gait4").parametrize(0.08).write("b.gif")
    assert duration_of(Path("a.gif")) == duration_of(Path("b.gif")) == 80

"""The geometry of a drawn vehicle, and films of gaits."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from PIL import GifImagePlugin, Image

import gaitgraph as gg
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.plots import films
from gaitgraph.plots.axes import ROTOR_COLORS
from gaitgraph.plots.films import frames_of, write_films
from gaitgraph.plots.vehicles import (
    FROM_ABOVE,
    VehicleView,
    draw_vehicle,
    vehicle_view,
)
from gaitgraph.timing.timed_gait import table_of

if TYPE_CHECKING:
    from collections.abc import Callable

X_FRAME = gg.Vehicle(
    name="an <X> & more",
    drag_ratio=0.12,
    first_arm_angle=math.pi / 4,
    first_rotor_spin="counterclockwise",
)
BEHIND, RIGHT = (math.pi, 0.0), (-math.pi / 2, 0.0)


# The vehicle


@pytest.mark.parametrize("vehicle", [gg.PAPER, X_FRAME], ids=["paper", "x_frame"])
def test_discs_face_along_the_forces_of_the_rotors(vehicle: gg.Vehicle) -> None:
    """Three views put together are vectors in body axes, in arm lengths."""
    alpha = np.random.default_rng(6).uniform(-math.pi, math.pi, (40, 4))
    views = [
        [vehicle_view(angles, vehicle, view=view) for angles in alpha]
        for view in (FROM_ABOVE, BEHIND, RIGHT)
    ]

    def vectors(of: Callable[[VehicleView], np.ndarray]) -> np.ndarray:
        # From above the screen's right is −y and its up x; from behind right is −y, up z; from the right x and z.
        above, behind, right = (np.array([of(seen) for seen in row]) for row in views)
        x, y, z = above[..., 1], -above[..., 0], behind[..., 1]
        assert np.allclose(-behind[..., 0], y)
        assert np.allclose(right, np.stack([x, z], axis=-1))
        return np.stack([x, y, z], axis=-1)

    across = vectors(lambda seen: seen.rims[:, 0] - seen.centres)
    along = vectors(lambda seen: seen.rims[:, 18] - seen.centres)
    thrust = vectors(lambda seen: seen.tips - seen.centres)
    # One unit of thrust pushing away from the body, with any coefficients: only the direction counts.
    kappa = vehicle.drag_ratio
    whole = vehicle.replace(
        thrust_coefficient=1.0, arm_length=1.0, drag_ratio=kappa, drag_coefficient=None
    )
    force = gg.invertibility.control_force_matrix(alpha, whole)
    force = np.swapaxes(
        force * np.sign(gg.invertibility.control_force_matrix(np.zeros(4), whole)[2]),
        -1,
        -2,
    )
    assert np.allclose(thrust / np.linalg.norm(thrust, axis=-1, keepdims=True), force)
    normal = np.cross(across, along)
    assert np.allclose(normal / np.linalg.norm(normal, axis=-1, keepdims=True), force)
    # A disc is round, and turns about its arm.
    assert np.allclose((across * along).sum(axis=-1), 0.0)
    assert np.allclose(np.linalg.norm([across, along], axis=-1), 0.5)
    angles = vehicle.first_arm_angle + np.arange(4) * math.pi / 2
    assert np.allclose(
        across, 0.5 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    )


def test_a_view_stays_within_its_limits() -> None:
    alpha = np.random.default_rng(7).uniform(-math.pi, math.pi, (200, 4))
    for view in ((0.3, 0.5), (2.0, -1.2), FROM_ABOVE, BEHIND, (-2.7, 0.6)):
        for angles in alpha:
            seen = vehicle_view(angles, X_FRAME, view=view)
            low, high = seen.limits
            for places in (seen.rims, seen.tips, seen.labels, seen.arms, seen.nose):
                assert ((places >= low) & (places <= high)).all()


def test_a_vehicle_from_above_and_from_below() -> None:
    above = vehicle_view([0.0, 0.0, 0.0, 0.0], view=FROM_ABOVE)
    assert above.facing.all()
    np.testing.assert_allclose(
        above.arms, [[0, 1], [-1, 0], [0, -1], [1, 0]], atol=1e-12
    )  # forward up, left left
    np.testing.assert_allclose(above.nose, [0.0, 0.34], atol=1e-12)
    assert not vehicle_view([0.0, 0.0, 0.0, 0.0], view=(0.0, -1.0)).facing.any()
    behind = vehicle_view([0.0, 0.0, 0.0, 0.0], view=(math.pi, 0.5))
    assert (behind.order[0], behind.order[-1]) == (
        0,
        2,
    )  # the forward rotor is farthest
    pulls = vehicle_view([0.0] * 4, view=FROM_ABOVE, thrusts=[1.0, -1.0, 1.0, 0.5])
    assert pulls.facing.tolist() == [True, False, True, True]
    for wrong in ([0.0, 0.0], [[0.0, math.nan, 0, 0]]):
        with pytest.raises(gg.InputError, match="alpha must be "):
            vehicle_view(wrong)


def test_a_vehicle_is_drawn_as_its_view_says() -> None:
    seen = vehicle_view([1.1, -1.1, 1.1, -1.1])
    ax = Figure().add_subplot()
    assert set(draw_vehicle(ax, seen)) == {*ax.lines, *ax.patches, *ax.texts}
    for disc, rotor in zip(
        sorted(ax.patches, key=lambda patch: patch.get_zorder()),
        seen.order,
        strict=True,
    ):
        rim = np.asarray(disc.get_xy())  # type: ignore[attr-defined]
        np.testing.assert_allclose(
            rim[:-1].mean(axis=0), seen.centres[rotor], atol=0.01
        )
        assert (
            to_hex(disc.get_facecolor()) == ROTOR_COLORS[rotor]
        )  # from above and from below
    assert [text.get_text() for text in ax.texts if text.get_text()] == [
        "1",
        "2",
        "3",
        "4",
    ]


# Films


def durations_of(image: Any) -> list[int]:
    """Return how long each frame lasts [ms]."""
    found = []
    for k in range(image.n_frames):
        image.seek(k)
        found.append(image.info["duration"])
    return found


def test_a_gif_plays_one_period_for_ever_and_states_what_made_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(films, "_FEWEST", 2)
    timed = gg.lift(
        [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red"
    ).parametrize(0.4)
    table = table_of(timed)
    write_films(table, [tmp_path / "gait.gif", tmp_path / "again.gif"])
    assert (tmp_path / "gait.gif").read_bytes() == (tmp_path / "again.gif").read_bytes()
    with Image.open(tmp_path / "gait.gif") as image:
        assert isinstance(image, GifImagePlugin.GifImageFile)
        assert (image.size, image.info["loop"], image.n_frames) == ((480, 420), 0, 10)
        assert image.info["comment"].decode() == provenance_text(table)
        assert sum(durations_of(image)) == 400
        image.seek(0)
        pixels = np.asarray(image.convert("RGB")).astype(int)
    for disc in ROTOR_COLORS:
        assert (
            np.abs(pixels - [int(disc[k : k + 2], 16) for k in (1, 3, 5)]).max(axis=-1)
            <= 12
        ).sum() > 300


def test_a_film_has_25_frames_a_second_and_lasts_from_0_4_s_to_a_minute() -> None:
    for period, count in (
        *((1e-6, 10), (0.4, 10), (0.5, 12), (1.0, 25), (1.234, 31), (4.0, 100)),
        *((60.0, 1500), (1e9, 1500)),
    ):
        assert frames_of(period) == count


def test_films_of_other_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Uneven times, a hostile name, and a table without times, which lasts a second."""
    monkeypatch.setattr(films, "_FEWEST", 2)
    columns = {
        f"alpha{k + 1}": np.linspace(-1.5, 1.5, 30) * (-1) ** k for k in range(4)
    }
    about = {"vehicle": X_FRAME.as_mapping(), "coefficients": "exact"}
    uneven = Table(
        columns={"t": 1e-3 * np.linspace(0, 1, 30) ** 2, **columns}, about=about
    )
    single = Table(columns={name: values[:1] for name, values in columns.items()})
    for one, total in ((uneven, 80), (single, 1000)):
        write_films(one, [tmp_path / "a.gif"], force=True)
        with Image.open(tmp_path / "a.gif") as image:
            assert sum(durations_of(image)) == total


def test_films_that_cannot_be_written_are_refused(
    run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(name: str, why: str) -> None:
        with pytest.raises(gg.GaitgraphError, match=re.escape(why)):
            write_films(
                Table(columns={f"alpha{k}": np.zeros(1) for k in (1, 2, 3, 4)}), [name]
            )

    Path("taken.gif").write_text("mine")
    refused("a.svg", "must be .gif or .mp4")
    refused("taken.gif", "'taken.gif' exists")
    monkeypatch.setattr(FFMpegWriter, "isAvailable", lambda: False)
    refused("a.mp4", "MP4 needs the program ffmpeg")
    assert [path.name for path in Path().iterdir()] == ["taken.gif"]


def test_the_command_line_and_timed_gaits_write_films(
    run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(films, "_FEWEST", 2)
    plan = (
        "plan",
        "--waypoint",
        "0.4,-1.2",
        "--waypoint",
        "0.4,-0.4",
        "--period",
        "0.2",
        "--samples",
        "20",
    )
    assert "wrote a.gif" in run(*plan, "--output", "gait.csv", "--output", "a.gif").out
    gg.lift([(0.4, -1.2), (0.4, -0.4)], "red").parametrize(0.2, samples=20).write(
        "c.gif"
    )
    os.mkfifo("pipe.csv")  # which can be read once
    Thread(
        target=Path("pipe.csv").write_bytes,
        args=[Path("gait.csv").read_bytes()],
        daemon=True,
    ).start()
    assert (
        run("export", "pipe.csv", "b.gif", "b.json").out.splitlines()[0]
        == "wrote b.gif: one period, drawn"
    )
    for name in "abc":
        with Image.open(f"{name}.gif") as film:
            assert (film.size, sum(durations_of(film))) == ((480, 420), 200)

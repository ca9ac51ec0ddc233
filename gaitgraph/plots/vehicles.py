"""The vehicle: the geometry of all its drawings, one drawing by matplotlib, Figure 1, and films of gaits.

The projection is orthographic. The image of a rotor's disc is an ellipse: the unit disc under an affine map
(a, b, c, d, e, f), x' = a·x + c·y + e and y' = b·x + d·y + f.

A film of a gait shows one period: the vehicle with its discs and lines of thrust, and below it the four angles over
time. The same gait gives the same GIF with the same versions of matplotlib and Pillow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.errors import InputError, needs_extra, shown
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.gait import name_of
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.invertibility.matrices import rotor_directions, thrust_signs
from gaitgraph.io.formats import FILMS
from gaitgraph.plots.axes import (
    ROTOR_COLORS,
    axes_or_new,
    draw_arrow,
    draw_label,
    paper_style,
)
from gaitgraph.timing.timed_gait import table_of, timed_gait_of
from gaitgraph.vehicle import PAPER, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.forms import FloatArray

# Positions of the viewer: azimuth from forward, positive to the left, and elevation [rad].
DEFAULT_VIEW = (math.radians(-152.0), math.radians(33.0))  # behind, right and above
FROM_ABOVE = (math.pi, math.pi / 2)  # forward is up
INK, LINE_GREY = "#23262b", "#767b85"
_DISC, _STALK, _THRUST, _NOSE, _LABEL = 0.5, 0.1, 0.62, 0.34, 0.24  # in arm lengths


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VehicleView:
    """A vehicle seen from one direction, for n samples of its tilt angles.

    Positions are in arm lengths from the centre of mass, x to the right and y upwards on the screen. A disc is an
    affine map a, b, c, d, e, f of the unit disc: its x axis is the outward arm axis, its y axis turns with the tilt.
    Its line of thrust begins at the centre (e, f).
    """

    discs: FloatArray  # (n, 4, 6)
    thrusts: FloatArray  # (n, 4, 2), ends of the lines of thrust
    facing: npt.NDArray[
        np.bool_
    ]  # (n, 4), whether the viewer sees the side of the thrust
    arms: FloatArray  # (4, 2), outer ends
    hub: FloatArray  # (2,), where the arms meet, at the rotors' height
    nose: FloatArray  # (2,), end of an arrow from the centre that points forward
    order: tuple[
        int, ...
    ]  # rotors from the farthest to the nearest, counted from 0: the order of drawing
    clockwise: tuple[bool, ...]  # whether each rotor turns clockwise seen from above

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __repr__(self) -> str:
        return f"<VehicleView: samples: {len(self.discs)}>"

    @property
    def labels(self) -> FloatArray:
        """Positions of the rotors' numbers, shape (4, 2)."""
        return read_only(self.hub + (1.0 + _DISC + _LABEL) * (self.arms - self.hub))

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """The low and high corners of a rectangle that holds the vehicle at every tilt."""
        reach = max(_STALK + _THRUST, math.hypot(_STALK, _DISC))
        arms, labels = self.arms, self.labels
        around = np.concatenate(
            [arms - reach, arms + reach, labels - _LABEL, labels + _LABEL]
        )
        return read_only(around.min(axis=0)), read_only(around.max(axis=0))

    def as_mapping(self) -> dict[str, Any]:
        """Return the view as plain values for a picture of 480 by 360 px, y downwards, with rotors in order."""
        (low, high), size = self.limits, np.array([480.0, 360.0])
        flip = float(min(size / (high - low))) * np.array([1.0, -1.0])
        hub = size / 2 - flip * (low + high) / 2

        def pixels(places: FloatArray) -> list[Any]:
            return list(
                (np.round(hub + flip * places, 1) + 0.0).tolist()
            )  # without negative zeros

        shapes = np.round(self.discs[..., :4] * np.tile(flip, 2), 1) + 0.0
        columns: dict[str, Sequence[Any]] = {
            "disc": np.swapaxes(
                np.concatenate([shapes, pixels(self.discs[..., 4:])], axis=-1), 0, 1
            ).tolist(),
            "thrust": pixels(np.swapaxes(self.thrusts, 0, 1)),
            "facing": self.facing.T.tolist(),
            "arm": [[*pixels(self.hub), *end] for end in pixels(self.arms)],
            "label": pixels(self.labels),
            "clockwise": self.clockwise,
            "color": ROTOR_COLORS,
        }
        rotors = [
            dict(zip(columns, values, strict=True))
            for values in zip(*columns.values(), strict=True)
        ]
        places = {"hub": pixels(0.0 * self.nose), "nose": pixels(self.nose)}
        return {
            "size": size.tolist(),
            "frames": len(self.discs),
            "order": list(self.order),
            **places,
            "rotors": rotors,
        }


def screen_axes(view: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Return the directions right and up on the screen of a viewer at an azimuth and an elevation [rad]."""
    angles = angles_from(view, "view")
    if angles.shape != (2,):
        raise InputError(
            f"view must be an azimuth and an elevation (rad), got {shown(view)}",
            field="view",
        )
    azimuth, elevation = angles.tolist()
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    viewer = np.array([math.cos(azimuth), math.sin(azimuth), 0.0]) * math.cos(elevation)
    viewer[2] = math.sin(elevation)
    return right, np.cross(viewer, right)


def vehicle_view(
    alpha: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    *,
    view: tuple[float, float] = DEFAULT_VIEW,
    attitude: npt.ArrayLike | None = None,
    thrusts: npt.ArrayLike = 1.0,
    disc: float = _DISC,
) -> VehicleView:
    """Return the view of a vehicle at tilt angles of shape (n, 4) or (4,) [rad].

    Of the `vehicle` only the rotor height, the first arm's angle and the first rotor's spin matter. `view` is the
    viewer's azimuth and elevation, from −π/2 to π/2 [rad]; `attitude` the rotation from body axes to world axes, shape
    (3, 3), by default level. `thrusts`, shape (4,), are relative lengths of the lines of thrust, negative where a rotor
    pulls; `disc` is a rotor's radius in arm lengths.

    >>> vehicle_view([[0.0, 0.5, 0.0, 0.5]], view=FROM_ABOVE).discs.shape
    (1, 4, 6)
    """
    angles = np.atleast_2d(angles_from(alpha, "alpha"))
    if angles.ndim != 2 or angles.shape[1] != 4:
        raise InputError(
            f"alpha must be angles in radians, of the shape (n, 4), got {shown(alpha)}",
            field="alpha",
        )
    turned = np.eye(3) if attitude is None else np.asarray(attitude, dtype=float)
    right, up = screen_axes(view)
    screen = turned.T @ np.stack([right, up], axis=-1)
    toward = turned.T @ np.cross(right, up)

    vehicle = vehicle_named(vehicle)
    ends = np.array(vehicle.scaled_positions)
    outward = ends * [1.0, 1.0, 0.0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    # Direction of each thrust at a level tilt is up, whatever the spin; shape (n, 4, 3).
    thrust = np.swapaxes(
        rotor_directions(angles, vehicle)[0] * thrust_signs(vehicle), -1, -2
    )
    length = np.broadcast_to(np.asarray(thrusts, dtype=float), (4,))
    centre = ends + _STALK * thrust
    across = np.broadcast_to(disc * outward @ screen, (len(angles), 4, 2))
    return VehicleView(
        discs=np.concatenate(
            [across, disc * np.cross(thrust, outward) @ screen, centre @ screen],
            axis=-1,
        ),
        thrusts=(centre + _THRUST * length[:, None] * thrust) @ screen,
        facing=(thrust @ toward > 0) ^ (length < 0),
        arms=ends @ screen,
        hub=np.array([0.0, 0.0, vehicle.height_ratio]) @ screen,
        nose=_NOSE * screen[0],
        # By the depth of the arms' ends, because discs do not reach each other; equal depths keep the order.
        order=tuple(np.argsort(np.round(ends @ toward, 9), kind="stable").tolist()),
        clockwise=tuple((thrust_signs(vehicle) < 0).tolist()),
    )


_AROUND = np.linspace(0.0, math.tau, 73)
_CIRCLE = np.stack([np.cos(_AROUND), np.sin(_AROUND)])


def _rims(seen: VehicleView, sample: int) -> FloatArray:
    """Return the rims of the discs, shape (4, 2, 73)."""
    discs = seen.discs[sample]
    return np.asarray(
        discs[:, :4].reshape(4, 2, 2).swapaxes(1, 2) @ _CIRCLE + discs[:, 4:, None]
    )


def draw_vehicle(ax: Axes, seen: VehicleView, sample: int = 0) -> list[Any]:
    """Draw one sample of a view on axes of equal scales, in arm lengths, and return the artists."""
    drawn: list[Any] = []
    for arm in seen.arms:
        drawn.extend(_line(ax, seen.hub, arm, zorder=1, color=LINE_GREY, linewidth=3.6))
    if seen.hub.any():  # a mast from the centre of mass
        drawn.extend(
            _line(ax, (0.0, 0.0), seen.hub, zorder=1, color=LINE_GREY, linewidth=3.6)
        )
    drawn.append(
        draw_arrow(ax, (0.0, 0.0), seen.nose, INK, width=1.5, size=8.0, zorder=1.5)
    )
    drawn.extend(ax.plot(0.0, 0.0, "o", markersize=8.0, color=INK, zorder=1.5))
    rims = _rims(seen, sample)
    for place, rotor in enumerate(seen.order):
        centre, facing, order = (
            seen.discs[sample, rotor, 4:],
            bool(seen.facing[sample, rotor]),
            2.0 + 0.1 * place,
        )
        drawn.extend(
            _line(
                ax,
                seen.arms[rotor],
                centre,
                color=LINE_GREY,
                linewidth=2.9,
                zorder=order,
            )
        )
        drawn.extend(
            ax.fill(
                *rims[rotor],
                facecolor=ROTOR_COLORS[rotor],
                edgecolor=INK,
                linewidth=0.9,
                zorder=order + 0.02,
            )
        )
        drawn.extend(
            ax.plot(
                *centre,
                "o",
                markersize=3.6,
                markeredgewidth=0.0,
                color=INK,
                zorder=order + 0.03,
            )
        )
        tip, above = seen.thrusts[sample, rotor], order + (0.04 if facing else 0.01)
        drawn.append(
            draw_arrow(ax, centre, tip, INK, width=1.8, size=9.0, zorder=above)
        )
    for rotor, place in enumerate(seen.labels):
        box = {
            "boxstyle": "circle,pad=0.25",
            "facecolor": ROTOR_COLORS[rotor],
            "edgecolor": "white",
            "linewidth": 1.1,
        }
        look: dict[str, Any] = {
            "ha": "center",
            "va": "center",
            "weight": "bold",
            "color": "white",
            "zorder": 3,
        }
        drawn.append(
            ax.text(place[0], place[1], str(rotor + 1), bbox=box, fontsize=8.0, **look)
        )
    return drawn


def _line(ax: Axes, start: Any, end: Any, **look: Any) -> list[Any]:
    return list(ax.plot(*np.array([start, end]).T, **look))


_PAPER_DISC = 0.42
_LEAN = "#b35900"  # of tilt angles and the leaning thrusts


def vehicle_figure(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw a vehicle from above, and one rotor from the tip of its arm: axes, spins, positive tilts (Figure 1)."""
    ax = axes_or_new(ax)
    ax.set_axis_off()
    ax.set_aspect("equal")
    ax.set(xlim=(-2.75, 5.6), ylim=(-2.45, 2.3))
    seen = vehicle_view(np.zeros(4), vehicle, view=FROM_ABOVE, disc=_PAPER_DISC)
    for arm in seen.arms:
        _line(ax, (0.0, 0.0), arm, zorder=1, color="0.35", linewidth=2.5)
    for rim in _rims(seen, 0)[list(seen.order)]:
        ax.fill(*rim, facecolor="0.94", edgecolor="0.35", linewidth=0.8, zorder=2)
    for number, (outward, clockwise) in enumerate(
        zip(seen.arms, seen.clockwise, strict=True), start=1
    ):
        leaning = np.array(
            [outward[1], -outward[0]]
        )  # direction of the thrust at a positive tilt
        arc, look = (
            (340, 20) if clockwise else (200, 520),
            {"color": "0.35", "linewidth": 0.9, "zorder": 3},
        )
        _draw_arc(ax, outward, 0.8 * _PAPER_DISC, arc, mutation_scale=7, **look)
        draw_arrow(
            ax, (1 + _PAPER_DISC) * outward, (1.62 + _PAPER_DISC) * outward, "0.35"
        )
        draw_label(ax, (1.82 + _PAPER_DISC) * outward, rf"$e_{number}$")
        start = outward + _PAPER_DISC * leaning
        draw_arrow(
            ax, start, start + 0.5 * leaning, _LEAN, width=1.8, gid=f"lean {number}"
        )
        beyond = 0.5 + 0.42 * abs(leaning[0]) + 0.2 * abs(leaning[1])
        draw_label(ax, start + beyond * leaning, rf"$\alpha_{number}>0$", _LEAN)
        draw_label(ax, outward, f"{number}\n{'cw' if clockwise else 'ccw'}")
    corner = np.array([-2.2, -2.2])
    for axis in ((0.0, 0.75), (-0.5, 0.0)):
        draw_arrow(ax, corner, corner + axis, "black")
    for text, offset in (
        ("$x$ forward", (0.0, 0.92)),
        ("$y$ left", (-0.3, -0.2)),
        ("$z$ up", (0.38, 0.0)),
    ):
        draw_label(ax, corner + offset, text)
    _draw_axis_out_of_the_page(ax, corner, 5.0, 2.5)
    _draw_from_the_tip(ax)
    return ax


def _draw_axis_out_of_the_page(
    ax: Axes, place: FloatArray, ring: float, dot: float
) -> None:
    ax.plot(
        *place,
        marker="o",
        markersize=ring,
        markerfacecolor="white",
        markeredgecolor="black",
        zorder=4,
    )
    ax.plot(*place, marker=".", markersize=dot, color="black", zorder=5)


def _draw_arc(
    ax: Axes, center: FloatArray, radius: float, arc: tuple[float, float], **look: Any
) -> None:
    """Draw an arrow along an arc from one angle to another [°]."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path

    around = np.radians(np.linspace(*arc, 49))
    path = Path(center + radius * np.stack([np.cos(around), np.sin(around)], axis=-1))
    ax.add_patch(FancyArrowPatch(path=path, arrowstyle="-|>", **look))


def _draw_from_the_tip(ax: Axes) -> None:
    """Draw a rotor with a positive tilt, seen from outside along its arm."""
    hub, tilt, up = np.array([4.2, -0.75]), math.radians(32), np.array([0.0, 1.0])
    lean, across = (
        np.array([-math.sin(tilt), math.cos(tilt)]),
        np.array([math.cos(tilt), math.sin(tilt)]),
    )
    rotor = hub + 0.45 * lean
    _line(ax, hub, hub + 2.0 * up, color="0.35", linewidth=0.8, linestyle=(0, (4, 3)))
    _line(ax, hub, rotor, color="0.35", linewidth=2.0)
    _line(ax, rotor - 0.6 * across, rotor + 0.6 * across, color="0.35", linewidth=3.0)
    draw_arrow(ax, rotor, hub + 1.9 * lean, _LEAN, width=1.8)
    draw_label(ax, hub + 2.12 * lean, "thrust", _LEAN)
    _draw_arc(
        ax,
        hub,
        1.3,
        (90, 90 + math.degrees(tilt)),
        color=_LEAN,
        mutation_scale=8,
        shrinkA=0,
        shrinkB=0,
    )
    draw_label(
        ax,
        hub + 1.52 * np.array([-math.sin(tilt / 2), math.cos(tilt / 2)]),
        r"$\alpha_i>0$",
        _LEAN,
    )
    _draw_axis_out_of_the_page(ax, hub, 8.0, 4.0)
    draw_label(ax, hub + np.array([0.3, -0.02]), "$e_i$")
    draw_label(ax, hub + np.array([0.1, 2.2]), "$z$")
    text = "rotor $i$ from the tip of its arm:\npositive tilts are right-handed\nabout the outward axis $e_i$"
    draw_label(ax, hub - 0.75 * up, text)


PALE = "#dfe2e7"
FILM_WIDTH, FILM_HEIGHT = 480, 420  # px, at 100 per inch
_DELAY = 4  # longest duration of a frame [1/100 s]
_SHORTEST, LONGEST, _FEWEST = (
    20,
    6000,
    10,
)  # durations of a film [1/100 s], and least number of frames
_PICTURE = (0.0, 112 / 420, 1.0, 272 / 420)  # axes: left, bottom, width, height
_CHART = (52 / 480, 28 / 420, 412 / 480, 66 / 420)


def check_films(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise if a film cannot be written: wrong suffix, missing library, existing file."""
    for path in map(Path, paths):
        if path.suffix.lower() not in FILMS:
            raise InputError(
                f"output of a film must be {' or '.join(FILMS)}, got {str(path)!r}"
            )
        try:
            from matplotlib import animation
            from PIL import Image as _  # noqa: F401
        except ImportError as error:
            raise needs_extra(error.name or "Pillow", "a film", "plot") from error
        if path.suffix.lower() == ".mp4" and not animation.FFMpegWriter.isAvailable():
            raise InputError(
                f"output {str(path)!r}: MP4 needs the program ffmpeg. Install it, or write a .gif"
            )
    check_new_files(paths, force=force)


def write_films(
    gait: GaitLike, paths: Sequence[str | Path], *, force: bool = False
) -> None:
    """Write films of one period of a gait, whole or not at all.

    `gait` may have any form; rows without times take 1 s. `paths` end in .gif or .mp4, which needs ffmpeg. `force`
    overwrites existing files.
    """
    check_films(paths, force=force)
    source = given_gait(gait).source
    timed = timed_gait_of(source)
    table = source if isinstance(source, Table) else table_of(timed)
    period, name = timed.period, timed.gait.vehicle.name
    phases, delays = film_clock(period)
    seen = vehicle_view(timed.at(phases * period).alpha, timed.gait.vehicle)
    name = name if len(name) <= 32 else name[:31] + "…"
    law, seconds = table.about.get("law"), sum(delays) / 100
    title = f"{name_of(timed.gait)} · vehicle {name} · T = {period:g} s" + (
        f" · {law}" if isinstance(law, str) else ""
    )
    if abs(seconds - period) > max(0.005, 1e-9 * period):
        title += f" (shown {'slower' if seconds > period else 'faster'}: {seconds:g} s)"
    with paper_style():
        figure, picture, chart = blank_film(title, seen, 1.0)
        times = np.linspace(0.0, period, 161)
        # Opposite rotors move together on the red sheet: they differ in width.
        looks = [
            (color, 3.6 if k < 2 else 1.3, "") for k, color in enumerate(ROTOR_COLORS)
        ]
        cursor = draw_chart(
            chart, times, np.degrees(timed.at(times).alpha.T), looks, 10.0
        )

        def frame(k: int) -> list[Any]:
            cursor.set_xdata([phases[k] * period])
            return draw_vehicle(picture, seen, k)

        write = partial(write_frames, figure, frame, delays, provenance_text(table))
        write_whole([(Path(path), write) for path in paths], force=force)


def film_clock(seconds: float) -> tuple[FloatArray, list[int]]:
    """Return when each frame begins, as fractions of a film, and its duration [1/100 s].

    There are 25 frames a second or more; the film lasts from 0.2 s to a minute.
    """
    total = round(min(max(100 * seconds, _SHORTEST), LONGEST))
    count = max(math.ceil(total / _DELAY), _FEWEST)
    begins = [round(total * k / count) for k in range(count + 1)]
    return np.array(begins[:-1]) / total, np.diff(begins).tolist()


def blank_film(title: str, seen: VehicleView, zoom: float) -> tuple[Figure, Axes, Axes]:
    """Return a figure with axes for a vehicle, which fits at `zoom` 1, and axes for curves."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(FILM_WIDTH / 100, FILM_HEIGHT / 100), dpi=100)
    picture = figure.add_axes(_PICTURE)
    picture.set_axis_off()
    low, high = seen.limits
    size = np.array([_PICTURE[2] * FILM_WIDTH, _PICTURE[3] * FILM_HEIGHT])
    half = size * float(max((high - low) / size)) / 2 / zoom
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    picture.set(xlim=(left, right), ylim=(bottom, top))
    figure.text(
        16 / FILM_WIDTH,
        1 - 19 / FILM_HEIGHT,
        title,
        fontsize=10,
        color=INK,
        va="center",
    )
    return figure, picture, figure.add_axes(_CHART)


def draw_chart(
    ax: Axes,
    times: FloatArray,
    curves: FloatArray,
    looks: Sequence[tuple[str, float, str]],
    step: float,
) -> Line2D:
    """Draw angles [°] over time and return the cursor. The axis ends at a multiple of `step`."""
    most = max(step * math.ceil(float(np.abs(curves).max()) / step - 1e-9), step)
    for curve, (color, width, label) in zip(curves, looks, strict=True):
        ax.plot(times, curve, color=color, linewidth=width, label=label)
    end = max(float(times[-1]), 1e-9)
    ax.set(
        xlim=(0.0, end),
        ylim=(-most, most),
        xticks=[0.0, end],
        yticks=[-most, 0.0, most],
    )
    ax.set_xticklabels(["0", f"{end:.4g} s"])
    ax.set_yticklabels([f"−{most:g}°", "0", f"{most:g}°"])
    ax.tick_params(length=0, labelcolor=LINE_GREY)
    ax.spines[["top", "right", "bottom"]].set_visible(False)
    ax.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    return ax.axvline(0.0, color=INK, linewidth=0.9)


def write_frames(
    figure: Figure,
    frame: Callable[[int], list[Any]],
    delays: Sequence[int],
    about: str,
    path: Path,
) -> None:
    """Write a film. `frame` draws frame k and returns the artists to remove before the next one."""
    from matplotlib.animation import FFMpegWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    def drawn(numbers: Iterable[int]) -> Iterator[None]:
        for k in numbers:
            passing = frame(k)
            yield
            for one in passing:
                one.remove()

    if path.suffix.lower() == ".mp4":
        rate = (
            100 * len(delays[:-1]) / sum(delays[:-1])
        )  # the last frame may stay longer
        writer: Any = FFMpegWriter(fps=rate, metadata={"comment": about})  # type: ignore[arg-type]
        with writer.saving(figure, path, dpi=100):
            for delay, _ in zip(delays, drawn(range(len(delays))), strict=True):
                for _ in range(max(round(delay * rate / 100), 1)):
                    writer.grab_frame()
        return
    canvas: Any = FigureCanvasAgg(figure)

    def pictures(numbers: Iterable[int]) -> Iterator[Any]:
        for _ in drawn(numbers):
            canvas.draw()
            yield Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

    # One color table for all frames, from a few of them; dither would flicker.
    some = [
        np.asarray(one)
        for one in pictures(range(0, len(delays), max(len(delays) // 6, 1)))
    ]
    color_table = Image.fromarray(np.concatenate(some)).quantize(
        255, dither=Image.Dither.NONE
    )
    first, *others = (
        one.quantize(palette=color_table, dither=Image.Dither.NONE)
        for one in pictures(range(len(delays)))
    )
    times = [10 * delay for delay in delays]
    first.save(
        path,
        save_all=True,
        append_images=others,
        duration=times,
        loop=0,
        comment=about.encode("ascii"),
    )

"""Flights over time: attitude, place, thrusts, tilt angles, and how near the decoupling matrix is to a singular one."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.plots.axes import GREY, RED, axes_or_new, legend_above, require_matplotlib
from gaitgraph.plots.scenes import ROTOR_COLORS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.record import Flight

__all__ = ["PANELS", "figure_of_panels", "flights_side_by_side", "name_of_flight", "plot_flight"]

PANELS = ("attitude", "place", "thrusts", "tilts", "singular_value")
"""What a flight is drawn as, from the top."""

_HEIGHTS = {"attitude": 40.0, "place": 38.0, "thrusts": 42.0, "tilts": 38.0, "singular_value": 38.0}  # mm
_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM = 170.0, 19.0, 4.0, 13.0, 12.0
_LEGEND = 8.0  # above each panel, part of its height
_INK = "#23262b"
_HELD = "#7b3294"  # what is asked for

# In no color of a sheet; opposite rotors, which move together on the red sheet, differ in width.
_ROTORS: tuple[dict[str, Any], ...] = (
    {"color": ROTOR_COLORS[0], "linewidth": 3.2},
    {"color": ROTOR_COLORS[1], "linewidth": 3.2},
    {"color": "black", "linewidth": 1.1, "linestyle": (0, (5, 2))},
    {"color": "black", "linewidth": 1.1, "linestyle": (0, (1, 1.2))},
)
_MOST_SHARES = 8.0  # beyond it thrusts are drawn to a logarithmic scale
_MOST_DEGREES = 60.0  # of attitudes side by side, lest one that tumbles makes the others flat
_LETTERS = 96  # of a title's line
_NAME = 24  # letters of a vehicle's


def plot_flight(flight: Flight, *, axes: Any = None, panels: Sequence[str] = PANELS, title: str | None = None) -> Any:
    """Draw what happened in a flight over time.

    Parameters
    ----------
    flight
        What :func:`gaitgraph.flight.simulation.fly` returns. One that was refused has nothing to draw: its reason is written.
    axes
        As many plane axes as there are panels; by default those of a new figure, one below another.
    panels
        Which of :data:`PANELS`, in order: roll, pitch and yaw [°]; x, y and z [m]; thrusts as multiples of a quarter
        of the weight, with their limits; tilt angles [°]; and the band in which the least singular value of the scaled
        decoupling matrix lies, with the value at which flight stops. What is asked for is dashed.
    title
        Of the first panel; by default what was flown, and the verdict.

    Returns
    -------
    array of axes
        A red line at the time of a stop has "stop" as its ``gid``.
    """
    for name in panels:
        if name not in PANELS:
            hint = did_you_mean(name, list(PANELS)) if isinstance(name, str) else ""
            raise InputError(f"panels: {shown(name)}; allowed are {', '.join(PANELS)}{hint}")
    axes = _new_axes(panels) if axes is None else np.ravel(np.asarray(axes, dtype=object))
    if len(axes) != len(panels):
        raise InputError(f"axes: {len(axes)} of them; allowed are {len(panels)}, one a panel")
    for ax, name in zip(axes, panels, strict=True):
        axes_or_new(ax)
        _DRAWN[name](ax, flight)
        ax.grid(True)
        if not len(flight.rows):
            ax.text(0.5, 0.5, "nothing flown", color=GREY, ha="center", va="center", transform=ax.transAxes)
            ax.set(xlim=(0.0, flight.settings.seconds))
            continue
        ax.set(xlim=(0.0, max(_end_of(flight), 1e-9)))
        _mark_phases(ax, flight, named=ax is axes[0])
        if flight.failed:
            ax.axvline(flight.flown, color=RED, linewidth=1.6, gid="stop", zorder=4)
    axes[-1].set(xlabel="$t$ (s)")
    told = [name_of_flight(flight), _verdict(flight)] if title is None else [title]
    axes[0].set_title("\n".join(line for one in told for line in wrap(one, _LETTERS)), pad=20.0)
    return axes


def name_of_flight(flight: Flight) -> str:
    """Return what was flown in a line: the gait's color, the vehicle, T, the reference, the attitude at the start."""
    timed, settings = flight.course.timed, flight.settings
    size, lap = f"{settings.size:g} m", f"{settings.lap:g} s"
    follows = {
        "hover": ["hover"],
        "step": [f"step of {size}"],
        "line": [f"line of {size} in {lap}"],
        "circle": [f"circle of {size} in {lap}"],
    }
    roll, pitch = (f"{angle:.3g}°" for angle in np.degrees(flight.attitude))
    name = flight.vehicle.name
    parts = [
        f"{timed.gait.color.capitalize()} gait" if timed.gait.color else "Gait on neither sheet",
        f"vehicle {name if len(name) <= _NAME else name[: _NAME - 1] + '…'}",
        f"T = {timed.period:g} s",
        *follows.get(settings.reference, []),
        *(["entered from hover"] if len(flight.course.pieces) > 1 else []),
        f"from roll {roll}, pitch {pitch}",
    ]
    return " · ".join(parts).replace("-", "−")


def flights_side_by_side(
    flights: Mapping[str, Flight], *, panels: Sequence[str] = ("attitude", "thrusts", "singular_value")
) -> Any:
    """Draw flights in columns of a new figure, each panel to one scale; attitudes beyond 60° are cut off.

    Parameters
    ----------
    flights
        What each is called, to the flight.
    panels
        As for :func:`plot_flight`.

    Returns
    -------
    array of axes of shape (panels, flights)
    """
    if not flights:
        raise InputError("flights: none; allowed is at least one")
    require_matplotlib()
    from matplotlib import pyplot

    height = _size_of(panels)[1] + 8.0 / 25.4
    figure = pyplot.figure(figsize=(max(85.0, 57.0 * len(flights)) / 25.4, height), layout="constrained")
    axes = figure.subplots(len(panels), len(flights), sharex=True, sharey="row", squeeze=False)
    ends: list[list[tuple[float, float]]] = [[] for _ in panels]
    for k, (name, flight) in enumerate(flights.items()):
        verdict = "\n".join(wrap(_verdict(flight), 38))
        plot_flight(flight, axes=axes[:, k], panels=panels)
        axes[0, k].set_title(f"{name}\n{verdict}", pad=5.0, fontsize=7.5)
        if len(flight.rows):
            for panel, own, ax in zip(panels, ends, axes[:, k], strict=True):
                reach = np.clip(1.1 * ax.dataLim.intervaly, -_MOST_DEGREES, _MOST_DEGREES)
                own.append(tuple(reach.tolist()) if panel == "attitude" else ax.get_ylim())
    for own, ax in zip(ends, axes[:, 0], strict=True):
        if own:
            ax.set(ylim=(min(low for low, _ in own), max(high for _, high in own)))
    axes[0, 0].set(xlim=(0.0, max(_end_of(flight) for flight in flights.values())))
    for ax in axes[:, 1:].flat:
        ax.set(ylabel="")
    # Legends of panels are wider than columns; one below all serves them.
    named: dict[str, Any] = {}
    for ax in axes.flat:
        named |= {label: handle for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
        if ax.get_legend() is not None:
            ax.get_legend().remove()
    figure.legend(list(named.values()), list(named), loc="outside lower center", ncols=6)
    return axes


def figure_of_panels(panels: Sequence[str] = PANELS) -> tuple[Figure, Any]:
    """Return an empty figure apart from pyplot and any window, and the axes that :func:`plot_flight` draws on.

    Its layout is fixed, because a solver's depends on the order in which it meets its variables, and so do bytes.
    """
    require_matplotlib()
    from matplotlib.figure import Figure

    figure = Figure(figsize=_size_of(panels))
    return figure, _axes_of(figure, panels)


def _size_of(panels: Sequence[str]) -> tuple[float, float]:
    """Return width and height of a figure of panels, one below another [inch]."""
    return _WIDTH / 25.4, (_TOP + _BOTTOM + sum(_HEIGHTS[name] for name in panels)) / 25.4


def _axes_of(figure: Figure, panels: Sequence[str]) -> Any:
    height = _TOP + _BOTTOM + sum(_HEIGHTS[name] for name in panels)
    top = height - _TOP
    axes: list[Any] = []
    for name in panels:
        low = top - _HEIGHTS[name]
        place = (_LEFT / _WIDTH, low / height, (_WIDTH - _LEFT - _RIGHT) / _WIDTH, (_HEIGHTS[name] - _LEGEND) / height)
        axes.append(figure.add_axes(place, sharex=axes[0] if axes else None))
        top = low
    for ax in axes[:-1]:
        ax.tick_params(labelbottom=False)
    return np.array(axes, dtype=object)


def _new_axes(panels: Sequence[str]) -> Any:
    require_matplotlib()
    from matplotlib import pyplot

    return _axes_of(pyplot.figure(figsize=_size_of(panels)), panels)


def _end_of(flight: Flight) -> float:
    """Return the end of the time axis: what was to be flown, or a little beyond a stop that came early."""
    asked = min(flight.settings.seconds, flight.course.duration)
    return asked if not flight.failed else min(asked, max(1.25 * flight.flown, flight.flown + 0.02))


def _verdict(flight: Flight) -> str:
    if flight.refused:
        return flight.reason
    if flight.settled:
        return f"settled after {flight.settling_time:.2f} s"
    return f"{'stopped' if flight.failed else 'not settled'}: {flight.reason}"


def _mark_phases(ax: Axes, flight: Flight, *, named: bool) -> None:
    """Shade every other phase of a flight from hover."""
    course = flight.course
    if len(course.pieces) < 2:
        return
    begins = [begin for begin, _, _ in course.pieces] + [course.duration]
    for k, phase in enumerate(course.phases):
        begin, end = begins[k], min(begins[k + 1], ax.get_xlim()[1])
        if begin >= end:
            continue
        if k % 2:
            ax.axvspan(begin, end, color="#f0f0f3", linewidth=0.0, zorder=0)
        if named:
            ax.annotate(
                phase, (begin, 0.0), (3, 3), xycoords=ax.get_xaxis_transform(), textcoords="offset points", color=GREY
            )


def _draw_attitude(ax: Axes, flight: Flight) -> None:
    t = flight.column("t")
    looks = {"roll": (_INK, "-", 1.4), "pitch": ("#0072b2", "-", 1.4), "yaw": (GREY, (0, (1, 1)), 1.1)}
    for wanted in () if flight.settings.reference == "attitude" else ("roll_wanted", "pitch_wanted"):
        ax.plot(t, np.degrees(flight.column(wanted)), color=_HELD, linestyle="--", linewidth=0.8, label="asked for")
    for name, (color, dash, width) in looks.items():
        angle = np.degrees(flight.column(name))
        angle[1:][np.abs(np.diff(angle)) > 180.0] = np.nan  # it goes on at the other end
        ax.plot(t, angle, color=color, linestyle=dash, linewidth=width, label=name)
    ax.set(ylabel="attitude (°)")
    _widen(ax, 1.0)
    legend_above(ax, columns=4)


def _draw_place(ax: Axes, flight: Flight) -> None:
    t = flight.column("t")
    looks = {"x": (_INK, "-"), "y": ("#0072b2", "-"), "z": ("#d55e00", (0, (5, 1.5)))}
    held = ("z",) if flight.settings.reference == "attitude" else tuple(looks)
    for name in held:
        ax.plot(t, flight.column(f"{name}_wanted"), color=_HELD, linestyle="--", linewidth=0.8, label="asked for")
    for name, (color, dash) in looks.items():
        drifts = name not in held
        label = f"${name}$, free" if drifts else f"${name}$"
        ax.plot(t, flight.column(name), color=color, linestyle=dash, linewidth=0.9 if drifts else 1.4, label=label)
    ax.set(ylabel="place (m)")
    _widen(ax, 0.01)
    legend_above(ax, columns=4)


def _widen(ax: Axes, least: float) -> None:
    """Let the y axis reach so far at least, lest rounding be drawn large."""
    low, high = ax.get_ylim()
    ax.set(ylim=(min(low, -least), max(high, least)))


def _draw_thrusts(ax: Axes, flight: Flight) -> None:
    (mass,) = flight.vehicle.require("mass", purpose="a share of the weight")
    quarter = mass * flight.vehicle.gravity / 4.0
    t, shares = flight.column("t"), flight.thrusts / quarter
    for k, look in enumerate(_ROTORS):
        ax.plot(t, shares[:, k], label=f"rotor {k + 1}", **look)
    settings = flight.settings
    most = flight.vehicle.max_thrust if settings.thrust_limit is None else settings.thrust_limit
    for limit in (0.0, most) if settings.saturation else ():
        if limit is not None:
            ax.axhline(limit / quarter, color=RED, linewidth=0.9, linestyle="--", label="limits", zorder=1)
    if len(shares) and np.abs(shares).max() > _MOST_SHARES:
        ax.set_yscale("symlog", linthresh=4.0, linscale=1.5)
        tens = [10.0**k for k in range(1, 12)]
        ax.set_yticks([*(-ten for ten in reversed(tens)), 0.0, *tens])
        low, high = shares.min(), shares.max()
        ax.set(ylim=(min(2.0 * low, -1.0), max(2.0 * high, 4.0)))
    ax.axhline(1.0, color=GREY, linewidth=0.7, zorder=0)
    ax.set(ylabel="thrust\n(weight / 4)")
    legend_above(ax, columns=5)


def _draw_tilts(ax: Axes, flight: Flight) -> None:
    t = flight.column("t")
    for k, look in enumerate(_ROTORS):
        tilt = np.degrees(flight.column(f"alpha{k + 1}"))
        ax.plot(t, tilt, label=rf"$\alpha_{k + 1}$", **look)
    ax.set(ylabel="tilt (°)")
    legend_above(ax, columns=4)


def _draw_singular_value(ax: Axes, flight: Flight) -> None:
    t, near = flight.column("t"), flight.column("nearness")
    floor = flight.settings.floor
    ax.fill_between(t, near, 2.0 * near, color="#009e73", alpha=0.45, linewidth=0.0, label="lies in this band")
    if floor > 0:
        ax.axhline(floor, color=RED, linewidth=0.9, linestyle="--", label=f"flight stops below {floor:g}")
    ax.set_yscale("log")
    lowest = min(float(near.min()), floor) if floor > 0 and len(near) else float(near.min()) if len(near) else 0.01
    ax.set(ylabel="least singular\nvalue (1)", ylim=(max(0.6 * lowest, 1e-10), 3.0))
    legend_above(ax, columns=2)


_DRAWN: dict[str, Callable[[Axes, Flight], None]] = {
    "attitude": _draw_attitude,
    "place": _draw_place,
    "thrusts": _draw_thrusts,
    "tilts": _draw_tilts,
    "singular_value": _draw_singular_value,
}

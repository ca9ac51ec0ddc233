"""Draw the three pictures of the page on theory into the current folder."""

import numpy as np
from mpl_toolkits.mplot3d.axes3d import Axes3D

import gaitgraph as gg
from gaitgraph.invertibility.matrices import zero_moment_inputs
from gaitgraph.plots.axes import (
    BLUE,
    NEGATIVE,
    POSITIVE,
    RED,
    blank_figure,
    paper_style,
)
from gaitgraph.surface.red_components import red_label

GREEN = "#1b8a3c"
DELTA = gg.invertibility.coefficients_of(kind="exact").delta


def draw_directions() -> None:
    """Draw the zero-moment direction on red, off the surfaces, and on blue."""
    figure = blank_figure(170, 62)
    cases = {
        "(a) red sheet: N is vertical": [0.9, -0.5, 0.9, -0.5],
        "(b) off the surfaces: N leans": [0.9, -0.5, 0.9, -1.3],
        "(c) blue sheet: N = 0": [0.9, -0.5, 2 * DELTA - 0.9, -2 * DELTA + 0.5],
    }
    for place, (title, alpha) in enumerate(cases.items(), start=1):
        ax = figure.add_subplot(1, 3, place, projection="3d", computed_zorder=False)
        draw_direction(ax, alpha)
        ax.set_title(title, y=1.0)
    figure.savefig("theory_directions.png", bbox_inches="tight", pad_inches=0.03)


def draw_direction(ax: Axes3D, alpha: list[float]) -> None:
    """Draw thrusts without a torque, their sum N, and the disc across N."""
    thrust_axes = gg.invertibility.control_force_matrix(alpha).T
    thrust_axes = thrust_axes / gg.PAPER.thrust_coefficient
    # ν of the page, section 7, but for the factor −1/cos³ δ; the inputs of the package are those of v.
    u = -2 * gg.PAPER.drag_ratio * np.cos(DELTA) ** 3 * zero_moment_inputs(alpha)
    forces = thrust_axes * u[:, None]
    N = forces.sum(axis=0)
    if np.linalg.norm(N) > 1e-9:
        first, second = np.linalg.svd(N[None])[2][1:]
        around = np.linspace(0, 2 * np.pi, 73)[:-1, None]
        disc = 0.8 * (np.cos(around) * first + np.sin(around) * second)
        triangles = [(0, i, i + 1) for i in range(1, 71)]
        ax.plot_trisurf(*disc.T, triangles=triangles, color=GREEN, alpha=0.2)
        arrow = 0.9 * N / np.linalg.norm(N)
        ax.quiver(0, 0, 0, *arrow, color=GREEN, linewidth=2.2, arrow_length_ratio=0.15)
    turns = np.arange(4) * np.pi / 2
    hubs = 0.8 * np.stack([np.cos(turns), np.sin(turns), np.zeros(4)], axis=1)
    for hub, axis, force in zip(hubs, thrust_axes, forces, strict=True):
        arm = np.stack([0 * hub, hub], axis=1)
        rotor = np.stack([hub - axis / 4, hub + axis / 4], axis=1)
        ax.plot(*arm, color="0.5", linewidth=2.5)
        ax.plot(*rotor, color="0.5", linewidth=1.0)
        if np.linalg.norm(force) > 1e-9:
            black = {"color": "black", "linewidth": 1.3, "arrow_length_ratio": 0.25}
            ax.quiver(*hub, *(0.5 * force), **black)
    ax.plot([0, 0], [0, 0], [0, 1.0], ":", color="black", linewidth=0.9)
    ax.set(xlim=(-0.7, 0.7), ylim=(-0.7, 0.7), zlim=(-0.5, 0.9))
    ax.set_box_aspect((1, 1, 1), zoom=1.2)
    ax.view_init(16, -70)
    ax.set_axis_off()


def draw_planes() -> None:
    """Draw both planes of α3 over α1 and of α4 over α2, and where they cross."""
    figure = blank_figure(150, 78)
    a = np.linspace(-np.pi / 2, np.pi / 2, 721)
    names = {
        1: (r"$\delta$", r"$\delta-\pi/2$"),
        2: (r"$-\delta$", r"$\pi/2-\delta$"),
    }
    for k, sign in ((1, 1), (2, -1)):
        ax = figure.add_subplot(1, 2, k)
        gg.plots.plane_axes(ax, rf"\alpha_{k}", rf"\alpha_{k + 2}")
        minus = (2 * sign * DELTA - a + np.pi / 2) % np.pi - np.pi / 2
        minus[1:][np.abs(np.diff(minus)) > 1] = np.nan  # no line where it wraps
        plus = ax.plot(a, a, color=RED, linewidth=1.8)[0]
        dashes = ax.plot(a, minus, "--", color=BLUE, linewidth=1.8)[0]
        places = (sign * DELTA, sign * (DELTA - np.pi / 2))
        for place, name, y in zip(places, names[k], (-sign * 1.2, 0), strict=True):
            dots = ax.axvline(place, color="0.35", linewidth=0.9, linestyle=":")
            ax.plot(place, place, "ko", markersize=4)
            side = "left" if sign > 0 else "right"
            ax.text(place + 0.08 * sign, y, name, ha=side, va="center")
    handles = {
        "+ plane, red sheet": plus,
        "− plane, blue sheet": dashes,
        "? line: the planes cross": dots,
    }
    figure.legend(handles.values(), handles, loc="outside upper center", ncols=3)
    figure.savefig("theory_planes.png")


def draw_components() -> None:
    """Draw the seven regions of the red sheet, hover, and Gaits 3 and 4."""
    figure = blank_figure(110, 105)
    ax = figure.add_subplot()
    gg.plots.plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    a = np.linspace(-np.pi / 2, np.pi / 2, 801)
    sign_of_R = red_label(a[:, None], a[None, :]).prod(axis=-1)
    ax.contourf(a, a, sign_of_R.T, levels=[-2, 0, 2], colors=[NEGATIVE, POSITIVE])
    line, kappa = np.pi / 2 - DELTA, gg.PAPER.drag_ratio
    curve = np.arctan2(np.sin(a) - 2 * kappa * np.cos(a), np.cos(a))
    ax.plot(a, curve, color="black", linewidth=1.4)
    ax.plot(np.full(2, -line), a[[0, -1]], color="black", linewidth=1.4)
    ax.plot(a[[0, -1]], np.full(2, line), color="black", linewidth=1.4)
    numbers = [(-0.8, 0.0), (1.2, 0.3), (-1.49, 0), (0, 1.49)]
    small = [(-1.43, -1.53), (1.53, 1.43), (-1.49, 1.49)]
    centered = {"ha": "center", "va": "center"}
    for k, place in enumerate(numbers + small, start=1):
        size = 8 if k < 5 else 6
        ax.text(*place, str(k), fontweight="bold", fontsize=size, **centered)
    for k, side in ((3, 1), (4, -1)):
        low, high = side * np.pi / 8, side * 3 * np.pi / 8
        corners = [(low, -low), (high, -low), (high, -high), (low, -high), (low, -low)]
        ax.plot(*np.transpose(corners), color=RED)
        middle = side * np.pi / 4
        ax.text(middle, -middle, f"Gait {k}", color=RED, **centered)
    ax.plot(0, 0, "k+")
    ax.text(-0.06, 0, "hover", ha="right", va="center")
    equation = r"$\tan\alpha_1-\tan\alpha_2=2\kappa$"
    ax.text(0.75, 0.33, equation, rotation=45, **centered)
    ax.text(-line + 0.04, -0.9, r"$\alpha_1=\delta-\pi/2$", rotation=90, va="center")
    ax.text(0.9, line - 0.04, r"$\alpha_2=\pi/2-\delta$", ha="center", va="top")
    figure.savefig("theory_components.png")


with paper_style():
    draw_directions()
    draw_planes()
    draw_components()

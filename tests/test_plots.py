"""Pictures, by what is on their axes: data, marks, labels; and by what drawing leaves alone."""

from __future__ import annotations

import math
from itertools import combinations, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.collections import PathCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Annotation
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

import gaitgraph as gg
from gaitgraph import plots
from gaitgraph.angles import HALF_PI, wrapped
from gaitgraph.explorer.queries import diagram_of
from gaitgraph.invertibility.matrices import least_singular_value_on_red
from gaitgraph.plots.axes import BLUE, GREY, PALETTE, RED
from gaitgraph.plots.gaits import draw_robustness, draw_sheet
from gaitgraph.surface.sheets import PLANE_TYPES
from tests.published import GAITS
from tests.samples import BEETLE, EXACT, PUBLISHED

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes

STEP = math.pi / 16
GAIT3 = gg.lift(GAITS[2].angles, "red")


@pytest.fixture
def ax() -> Axes:
    return Figure().add_subplot()


def scatters(ax: Any) -> list[Any]:
    return [one for one in ax.collections if isinstance(one, PathCollection)]


def points_of(scatter: Any) -> np.ndarray:
    return np.column_stack([np.asarray(part) for part in scatter._offsets3d])


def by_label(space: Any) -> dict[str, np.ndarray]:
    """Return the points of each kind of mark, of all its layers."""
    found: dict[str, list[np.ndarray]] = {}
    for one in scatters(space):
        found.setdefault(one.get_gid(), []).append(points_of(one))
    return {name: np.concatenate(parts) for name, parts in found.items()}


def planes_of(space: Any) -> list[Any]:
    return [one for one in space.collections if isinstance(one, Poly3DCollection)]


def faces(scatter: Any) -> set[str]:
    return {to_hex(color) for color in np.asarray(scatter.get_facecolor())}


def unit(vector: Any) -> np.ndarray:
    return np.asarray(vector / np.linalg.norm(vector))


def lines_of(ax: Axes, gid: str) -> list[np.ndarray]:
    return [np.asarray(line.get_xydata()) for line in ax.lines if line.get_gid() == gid]


def legend_of(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


# Roots on the grid, as Figures 2 to 14 draw them


def space_of(name: str, **options: Any) -> Any:
    (ax,) = plots.draw(name, **options).axes
    return ax


def test_root_counts_hold_650_roots() -> None:
    places = {
        one.get_label(): np.asarray(one.get_offsets())
        for one in scatters(space_of("2"))
    }
    counted = {label: len(points) for label, points in places.items()}
    assert counted == {
        "2 roots, 225 nodes": 225,
        "3 roots, 60 nodes": 60,
        "5 roots, 4 nodes": 4,
    }
    np.testing.assert_allclose(np.abs(places["5 roots, 4 nodes"]), HALF_PI)


@pytest.mark.parametrize(("name", "over", "shift"), [("7", 0, 2), ("8", 1, -2)])
def test_both_roots_lie_on_two_planes(name: str, over: int, shift: int) -> None:
    space = space_of(name)
    points = by_label(space)
    assert {label: len(rows) for label, rows in points.items()} == {
        "+ plane": 225,
        "− plane": 225,
    }
    plus, minus = points["+ plane"], points["− plane"]
    np.testing.assert_allclose(plus[:, 2], plus[:, over], atol=1e-12)
    np.testing.assert_allclose(
        minus[:, 2], wrapped(shift * PUBLISHED.delta - minus[:, over]), atol=1e-12
    )
    assert {to_hex(one.get_facecolor()[0]) for one in scatters(space)} == {RED, BLUE}
    assert [len(part._faces) for part in planes_of(space)] == [
        1,
        2,
    ]  # the − plane wraps once


@pytest.mark.parametrize(
    ("names", "sign", "red", "blue"),
    [
        (("9", "11"), 1, 128, 28),
        (("13", "14"), -1, 97, 197),
        (("10", "12"), 1, 128, 28),
    ],
)
def test_signed_roots(names: tuple[str, str], sign: int, red: int, blue: int) -> None:
    """The first and the other root of each node, with one sign of R; with exact coefficients blue has none."""
    values = "10" in names
    published, exact = (
        [space_of(name, coefficients=kind) for name in names]
        for kind in ("published", "exact")
    )
    count = 0
    for space in published:
        assert {to_hex(one.get_facecolor()[0]) for one in scatters(space)} == {
            RED,
            BLUE,
        }
        points = by_label(space)
        if values:
            tops = points["red sheet"]
            alpha = np.column_stack([tops[:, :2], tops[:, :2]])
            np.testing.assert_allclose(
                tops[:, 2], gg.invertibility.level_determinant(alpha, PUBLISHED)
            )
            assert 0 < points["blue sheet"][:, 2].max() < 3e-4
            count += sum(map(len, points.values()))
        else:
            third, fourth = (
                part[np.lexsort(part[:, :2].T)] for part in points.values()
            )
            np.testing.assert_allclose(third[:, :2], fourth[:, :2])
            alpha = np.column_stack([third, fourth[:, 2]])
            assert (
                np.abs(gg.invertibility.roll_sensitivity(alpha, PUBLISHED)).max()
                < 1e-12
            )
            count += len(alpha)
        assert (
            np.sign(gg.invertibility.level_determinant(alpha, PUBLISHED)) == sign
        ).all()
    assert count == red + blue
    grey, signed = 0, 0
    for space in exact:
        for one in scatters(space):
            if to_hex(one.get_edgecolor()[0]) == GREY:
                assert not len(np.asarray(one.get_facecolor()))
                grey += len(points_of(one))
            else:
                signed += len(points_of(one))
        assert "R = 0 to rounding: singular" in legend_of(space)
    assert (grey, signed) == ((225, red) if values else (450, 2 * red))


# Types and the rule


@pytest.mark.parametrize("of", ["angle", "pair"])
def test_the_lines_of_the_rule_are_the_rule(ax: Axes, of: Any) -> None:
    assert plots.adjacency_rule(of, ax=ax) is ax
    drawn = {frozenset(str(line.get_gid()).split()) for line in ax.lines}
    pairs = combinations([label for label in PLANE_TYPES if label != "(?,?)"], 2)
    rule = {
        frozenset(pair) for pair in pairs if gg.surface.types_may_be_adjacent(*pair)
    }
    assert drawn == ({frozenset("+?"), frozenset("-?")} if of == "angle" else rule)
    assert len(drawn) == len(ax.lines) == (2 if of == "angle" else 8)
    places = {
        text.get_text().replace("−", "-"): text.get_position() for text in ax.texts
    }
    for line in ax.lines:
        ends = [tuple(point) for point in np.asarray(line.get_xydata())]
        assert ends == [places[label] for label in str(line.get_gid()).split()]


def marks_and_texts(
    ax: Axes,
) -> tuple[dict[str, set[tuple[int, int]]], dict[tuple[int, int], list[str]]]:
    """Return the nodes of each kind of mark, and what is written at the others."""
    marks: dict[str, set[tuple[int, int]]] = {}
    for one in scatters(ax):
        nodes = np.rint((np.asarray(one.get_offsets()) + HALF_PI) / STEP).astype(int)
        marks.setdefault(str(one.get_gid()), set()).update(map(tuple, nodes.tolist()))
    written: dict[tuple[int, int], list[str]] = {}
    for text in ax.texts:
        i, j = map(int, str(text.get_gid()).split(","))
        written.setdefault((i, j), []).append(text.get_text().replace("−", "-"))
    return marks, written


def test_type_map_of_the_paper(ax: Axes) -> None:
    """97 nodes have red and blue, 100 blue alone, 28 none; marks and written types share the 225 nodes."""
    assert plots.type_map(ax=ax) is ax
    marks, written = marks_and_texts(ax)
    assert set(marks) == {"yes yes", "no yes", "no no"}
    twice = {node for node, lines in written.items() if len(lines) == 2}
    once = {node for node, lines in written.items() if len(lines) == 1}
    assert len(marks["yes yes"] | twice) == 97
    assert len(marks["no yes"] | once) == 100
    assert len(marks["no no"]) == 28
    assert sum(map(len, marks.values())) + len(written) == 225
    graph = gg.surface_graph("negative")

    def types_at(node: tuple[int, int]) -> dict[str, str]:
        i, j = node
        names = {color: f"{i:03} {j:03} {color}" for color in ("red", "blue")}
        return {
            color: graph.nodes[name]["types"]
            for color, name in names.items()
            if name in graph
        }

    for node, lines in written.items():
        assert lines == list(types_at(node).values())
        assert all("?" in label for label in lines)
    for kind, colors in (
        ("yes yes", ("red", "blue")),
        ("no yes", ("blue",)),
        ("no no", ()),
    ):
        for node in marks[kind]:
            assert tuple(types_at(node)) == colors
    left, right = (
        one for one in scatters(ax) if one.get_gid() == "yes yes"
    )  # the halves of a mark
    assert (faces(left), faces(right)) == ({RED}, {BLUE})
    x = [np.asarray(one.get_paths()[0].vertices)[:, 0] for one in (left, right)]
    assert x[0].max() <= 1e-12 < -x[0].min()
    assert x[1].min() >= -1e-12 < x[1].max()
    assert legend_of(ax) == [
        "(+,+) and (−,−): $R < 0$",
        "(−,−): $R < 0$",
        "no root with $R < 0$",
    ]


def test_type_map_with_exact_coefficients_has_no_blue(ax: Axes) -> None:
    plots.type_map(coefficients=EXACT, ax=ax)
    marks, written = marks_and_texts(ax)
    assert set(marks) == {"yes singular", "no singular"}
    assert sum(map(len, marks.values())) + len(written) == 225
    assert set().union(*map(faces, scatters(ax))) == {RED, "#ffffff"}
    assert {to_hex(str(text.get_color())) for text in ax.texts} == {RED, GREY}
    assert legend_of(ax) == ["(+,+): $R < 0$, (−,−): $R = 0$", "(−,−): $R = 0$"]


# Gaits


@pytest.mark.parametrize("angles", [(1, 2), (1, 3), (4, 2)])
def test_gait_loop_is_the_projection(ax: Axes, angles: tuple[int, int]) -> None:
    assert plots.gait_loop(GAIT3, angles=angles, label="Gait 3", ax=ax) is ax
    (line,) = ax.lines
    ring = np.vstack([GAIT3.alpha, GAIT3.alpha[:2]])[:, [angles[0] - 1, angles[1] - 1]]
    np.testing.assert_allclose(np.asarray(line.get_xydata()), ring)
    assert (line.get_color(), line.get_label()) == (RED, "Gait 3")
    (arrow,) = (one for one in ax.texts if isinstance(one, Annotation))
    ahead = np.subtract(arrow.xy, arrow.xyann)
    assert any(
        unit(ahead) @ unit(step) > 1 - 1e-12
        for step in np.diff(ring, axis=0)
        if step.any()
    )


def test_gait_loops_of_other_kinds(ax: Axes) -> None:
    plots.gait_loop(gg.lift([(0.4, -0.4)], "red"), ax=ax)
    plots.gait_loop(
        gg.lift([(0.4, -0.4), (0.8, -0.4), (0.8, -0.8)], ["red", "blue", "blue"]), ax=ax
    )
    plots.gait_loop(GAIT3.biased(0.8), ax=ax)
    assert ax.lines[0].get_marker() == "s"
    assert [line.get_color() for line in ax.lines] == [RED, RED, RED, BLUE, "black"]
    plots.gait_loop(GAIT3, band=True, width=8, ax=ax)
    assert ax.lines[-1].get_zorder() < 2


def test_roll_pitch_diagram_draws_zeros_of_formula_1(ax: Axes) -> None:
    assert (
        plots.roll_pitch_diagram(GAIT3, bias=0.8, name="Gait 3", count=12, ax=ax) is ax
    )
    curves = lines_of(ax, "singular")
    biased = GAIT3.biased(0.8)
    places = biased.parametrize(law="constant-speed").at(np.arange(12) / 12).alpha
    assert len(curves) == 12
    for alpha, points in zip(places, curves, strict=True):
        assert (
            np.abs(gg.invertibility.determinant(alpha, EXACT, *points.T)).max() < 1e-9
        )
    full, part = (patch for patch in ax.patches if patch.get_gid() == "acceptable")
    assert np.ptp(full.get_path().vertices, axis=0) == pytest.approx(
        math.pi
    )  # all is shaded
    (border,) = lines_of(
        ax, "border"
    )  # of the biased gait alone, without the sides of the square
    assert len(border) > 50
    inside = np.abs(border) < HALF_PI - 1e-9
    assert inside[1:-1].all()
    assert part.get_path().contains_points(0.99 * border).all()
    assert legend_of(ax) == [
        "Gait 3:\nno singular attitude",
        "Gait 3, $\\eta$ = 0.8:\n85.15 % acceptable",
    ]
    assert {line.get_color() for line in ax.lines if line.get_gid() == "singular"} == {
        BLUE
    }


def test_pictures_reports_and_the_page_say_the_same_of_a_gait() -> None:
    """By default in exact physics, for gaits of any coefficients; the words are those of robustness_of."""
    points = np.array(GAITS[0].angles)
    printed = gg.Gait(
        alpha=np.column_stack([points, GAITS[0].printed]), coefficients=EXACT
    )
    everywhere, level = "singular at every attitude", "singular in level flight"
    for gait, verdict in (
        (gg.lift(points, "blue", coefficients=EXACT), everywhere),
        (gg.lift(points, "blue", coefficients="printed"), everywhere),
        (printed, everywhere),
        (gg.lift([(0.5, 0.5), (0.6, -0.6)], "red"), level),  # R = 0 between rows
        (GAIT3, "no singular attitude"),
        (GAIT3.biased(0.8), "85.15 % acceptable"),
    ):
        report = gg.robustness_of(gait)
        assert report.gait.verdict == verdict
        assert f"the gait itself: {verdict}" in str(report).splitlines()
        assert report.as_mapping()["verdict"] == verdict
        assert diagram_of(report.gait)["verdict"] == verdict
        ax = plots.roll_pitch_diagram(gait, ax=Figure().add_subplot())
        assert legend_of(ax) == [f"gait:\n{verdict}"]
        hatches = {patch.get_hatch() for patch in ax.patches}
        assert hatches == ({"xxx"} if verdict == everywhere else {None})
        figure = Figure()
        draw_sheet(figure, [gait.parametrize()])
        assert legend_of(figure.axes[3])[0].endswith(verdict)


def test_biased_and_scaled_gaits_have_names_of_their_own(ax: Axes) -> None:
    report = gg.robustness_of(GAIT3, bias=0.8, scale=0.5, curves=3)
    draw_robustness(ax, report, "Gait 3")
    firsts = [text.partition(":")[0] for text in legend_of(ax)]
    assert firsts == ["Gait 3", "Gait 3, $\\eta$ = 0.8", "Gait 3, scaled by 0.5"]


def test_roll_pitch_diagram_of_blue_turns_on_rounding() -> None:
    points = np.array(GAITS[0].angles)
    three = np.column_stack([points, GAITS[0].printed])
    blue = gg.lift(points, "blue")
    for gait, digits, verdict, curves in (
        (blue, {"coefficients": "printed"}, "no singular attitude", 0),
        (three, {"angle_rounding": 0.0}, "singular in level flight", 48),
    ):
        ax = plots.roll_pitch_diagram(gait, ax=Figure().add_subplot(), **digits)
        assert legend_of(ax) == [f"gait:\n{verdict}"]
        assert len(lines_of(ax, "singular")) == curves


# Regions


@pytest.mark.parametrize(
    "vehicle", [gg.PAPER, BEETLE, gg.Vehicle(drag_ratio=1.5)], ids=lambda v: v.name
)
def test_regions_map(ax: Axes, vehicle: gg.Vehicle) -> None:
    assert plots.regions_map(vehicle, ax=ax) is ax
    exact = gg.invertibility.coefficients_of(vehicle, "exact")
    curves = [
        np.asarray(line.get_xydata())
        for line in ax.lines
        if "= " in str(line.get_gid())
    ]
    assert len(curves) == (2 if vehicle.rotor_height else 3)
    for line in curves:
        points = line[np.isfinite(line).all(axis=1)]
        value = gg.invertibility.level_determinant(
            np.column_stack([points, points]), exact
        )
        assert np.abs(value).max() < 1e-9 * exact.form.size[2]
        assert np.abs(points).max() <= HALF_PI + 1e-12
    hover = [
        np.asarray(patch.get_path().vertices)[:4]
        for patch in ax.patches
        if patch.get_gid() == "hover"
    ]
    assert len(hover) == 2
    for corners in hover:
        assert (
            gg.invertibility.hover_thrust_shares(
                np.tile(corners.mean(axis=0), 2), vehicle
            )
            > 0
        ).all()
    (left, above), (right, below) = (corners.mean(axis=0) for corners in hover)
    for outside in ((left, below), (right, above)):
        assert (
            gg.invertibility.hover_thrust_shares(np.tile(outside, 2), vehicle) < 0
        ).any()
    named = {
        text.get_text(): text.get_position()
        for text in ax.texts
        if text.get_text().startswith("$R")
    }
    for text, place in named.items():
        assert (
            float(gg.invertibility.level_determinant(np.tile(place, 2), exact)) > 0
        ) == (">" in text)


@pytest.mark.parametrize(
    "vehicle", [gg.PAPER, BEETLE, gg.Vehicle(drag_ratio=1.25)], ids=lambda v: v.name
)
def test_singular_value_map(ax: Axes, vehicle: gg.Vehicle) -> None:
    assert plots.singular_value_map(vehicle, ax=ax) is ax
    filled, lines = (np.asarray(one.levels) for one in ax.collections[:2])  # type: ignore[attr-defined]
    axis = np.linspace(-HALF_PI, HALF_PI, 61)
    assert filled[0] == 0
    assert (
        filled[-1]
        >= least_singular_value_on_red(axis[:, None], axis[None, :], vehicle).max()
    )  # no holes
    for level, path in zip(lines, ax.collections[1].get_paths(), strict=True):
        points = np.asarray(path.vertices)
        np.testing.assert_allclose(
            least_singular_value_on_red(points[:, 0], points[:, 1], vehicle),
            level,
            atol=0.02,
        )


# The vehicle


@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
@pytest.mark.parametrize("angle", [0.0, math.pi / 4, -2.0])
def test_figure_1_shows_what_forces_do(ax: Axes, spin: Any, angle: float) -> None:
    vehicle = gg.PAPER.replace(first_rotor_spin=spin, first_arm_angle=angle)
    assert plots.vehicle_figure(vehicle, ax=ax) is ax
    upward = np.where(
        gg.invertibility.control_force_matrix([0.0] * 4, vehicle)[2] > 0, 1.0, -1.0
    )
    force = (gg.invertibility.control_force_matrix([0.1] * 4, vehicle) * upward)[:2]
    leans = {
        str(one.get_gid()): one
        for one in ax.texts
        if isinstance(one, Annotation) and one.get_gid()
    }
    for k in range(4):
        arrow = leans[f"lean {k + 1}"]
        on_page = np.subtract(arrow.xy, arrow.xyann)
        forward, left = on_page[1], -on_page[0]  # x up the page, y to the left
        np.testing.assert_allclose(unit([forward, left]), unit(force[:, k]), atol=1e-12)
    spins = [text.get_text() for text in ax.texts if text.get_text().endswith("cw")]
    # A rotor that turns counter-clockwise pushes up with w > 0.
    assert spins == [f"{k + 1}\n{'ccw' if upward[k] > 0 else 'cw'}" for k in range(4)]


# What drawing leaves alone, and what it refuses

PLOTS: dict[str, Callable[..., Any]] = {
    "vehicle_figure": plots.vehicle_figure,
    "adjacency_rule": plots.adjacency_rule,
    "type_map": plots.type_map,
    "gait_loop": lambda ax=None: plots.gait_loop(GAIT3, ax=ax),
    "regions_map": plots.regions_map,
    "singular_value_map": plots.singular_value_map,
    "roll_pitch_diagram": lambda ax=None: plots.roll_pitch_diagram(
        GAIT3, count=4, ax=ax
    ),
}


@pytest.mark.parametrize("name", PLOTS)
def test_plots_draw_on_given_axes_or_one_new_figure(ax: Axes, name: str) -> None:
    draw, before = PLOTS[name], dict(mpl.rcParams)
    assert draw(ax=ax) is ax
    assert pyplot.get_fignums() == []
    assert dict(mpl.rcParams) == before
    drawn = draw()
    assert pyplot.get_fignums() == [1]
    assert drawn.figure is pyplot.figure(1)
    for wrong in (Figure().add_subplot(projection="3d"), Figure(), 3):
        with pytest.raises(gg.InputError, match=r"^ax must be None or .*, got "):
            draw(ax=wrong)


def simulated(color: str, weights: Any) -> np.ndarray:
    """Return a color in CIELAB as dichromats see it, with the weights of linear red, green and blue."""
    levels = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(
        levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4
    )
    xyz = [
        [0.4124, 0.3576, 0.1805],
        [0.2126, 0.7152, 0.0722],
        [0.0193, 0.1192, 0.9505],
    ] @ np.clip(np.asarray(weights) @ linear, 0, 1)
    f = np.cbrt(np.maximum(xyz / [0.9505, 1.0, 1.089], 0.00886))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


# Full protanopia and deuteranopia by Machado, Oliveira and Fernandes (2009), and what all others see.
EYES = (
    np.eye(3).tolist(),
    [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
)
APART = (
    ("alpha1", "alpha2", "alpha3", "alpha4"),
    ("red", "blue"),
    ("shade-positive", "shade-negative"),
)


@pytest.mark.parametrize(
    "names",
    [*APART, ("yes", "partly", "no"), ("red", "yes"), ("red", "no"), ("blue", "yes")],
)
def test_colors_differ_for_all_eyes_on_light_and_dark(names: tuple[str, ...]) -> None:
    for one, other in combinations(names, 2):
        for dark, weights in product((0, 1), EYES):
            distance = np.subtract(
                *(simulated(PALETTE[name][dark], weights) for name in (one, other))
            )
            assert np.linalg.norm(distance) > 19, (one, other, dark)


def test_the_explorer_has_the_same_colors() -> None:
    style = (Path(gg.__file__).parent / "explorer" / "page" / "style.css").read_text(
        encoding="utf-8"
    )
    for name, (light, dark) in PALETTE.items():
        assert f"--{name}: light-dark({light}, {dark});" in style


# Pictures of objects

WAYPOINTS = [
    ("3pi/8", "-3pi/8"),
    ("3pi/8", "-pi/8"),
    ("pi/8", "-pi/8"),
    ("pi/8", "-3pi/8"),
]
BAR = [(-0.9, 0.3), (-0.7, 0.3), (-0.7, 0.6), (-0.9, 0.6)]
OBJECTS: dict[str, tuple[Callable[[], Any], list[str]]] = {
    "gait": (lambda: GAIT3, ["flyable, $R<0$", "$R=0$", "all upright", "gait, red"]),
    "blue": (
        lambda: gg.lift(GAITS[2].angles, "blue"),
        ["valid, $R=0$ in exact physics", "gait, blue"],
    ),
    "biased": (lambda: GAIT3.biased(0.8), ["gait, off the surfaces"]),
    "timed": (GAIT3.parametrize, [rf"$\alpha_{k}$" for k in (1, 2, 3, 4)]),
    "plan": (
        lambda: gg.plan_loop([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)], keep_out=[BAR]),
        [
            "flyable, $R>0$",
            "$R=0$",
            "all upright",
            "keep out",
            "gait, red",
            "waypoints",
        ],
    ),
    "no plan": (
        lambda: gg.plan_loop([(0.5, 0.5), (0.2, 0.7)], sign="negative"),
        ["flyable, $R<0$", "$R=0$", "all upright", "waypoints"],
    ),
    "report": (lambda: gg.validate(gg.lift(GAITS[2].angles, "blue")), []),
    "region": (gg.admissible_region, []),
    "vehicle": (lambda: gg.PAPER, []),
}


@pytest.mark.parametrize("name", OBJECTS)
def test_objects_draw_themselves_whole(name: str, ax: Axes) -> None:
    make, legend = OBJECTS[name]
    one = make()
    drawn = one.plot()
    figure: Any = drawn.figure
    assert [*figure.get_size_inches(), figure.dpi] == pytest.approx([6.0, 5.0, 150])
    figure.canvas.draw()
    tight = figure.get_tightbbox()
    assert 0 <= tight.x0 < tight.x1 <= 6.02
    assert 0 <= tight.y0 < tight.y1 <= 5.02
    assert one.plot(ax=ax) is ax
    assert ([] if drawn.get_legend() is None else legend_of(drawn)) == legend
    assert drawn.get_title()
    arrows = [
        text
        for text in drawn.texts
        if isinstance(text, Annotation) and text.arrow_patch is not None
    ]
    if name == "no plan":
        places = [arrow.xyann for arrow in arrows]
        assert places == [(0.5, 0.5), (0.2, 0.7)]  # both are to move
        assert gg.admissible_region(sign="negative").contains([arrows[0].xy]).all()
    if name == "report":
        bars = [bar.get_width() for bar in drawn.patches]
        assert len(bars) == len(one.checks)
        assert max(bars) == 1.5  # beyond its limit
        assert [text.get_text()[-1] for text in drawn.texts[1::2]] == [
            "✓",
            "✓",
            "✓",
            "✓",
            "?",
            "✗",
            "✗",
        ]
    with pytest.raises(
        gg.InputError,
        match="^only gaits, tables, plans, reports, other answers, regions and vehicles can be plotted, got 3",
    ):
        plots.plot(3)  # type: ignore[arg-type]


def test_wrong_values_are_refused(ax: Axes) -> None:
    cases: list[tuple[str, Callable[..., Any], tuple[Any, ...], dict[str, Any]]] = [
        ("sign", plots.type_map, (1,), {"ax": ax}),
        ("of", plots.adjacency_rule, ("loop",), {"ax": ax}),
        ("angles", plots.gait_loop, (GAIT3,), {"angles": (1, 1), "ax": ax}),
        ("angles", plots.gait_loop, (GAIT3,), {"angles": (0, 1), "ax": ax}),
        ("count", plots.roll_pitch_diagram, (GAIT3,), {"count": 0, "ax": ax}),
        ("bias", plots.roll_pitch_diagram, (GAIT3,), {"bias": 1.5, "ax": ax}),
    ]
    for name, draw, values, options in cases:
        with pytest.raises(gg.InputError, match=rf"^{name}( must be |: ).*"):
            draw(*values, **options)

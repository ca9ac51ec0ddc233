"""Pictures, by what is on their axes: data, marks, labels; and by what drawing leaves alone."""

from __future__ import annotations

import math
from itertools import combinations
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

import gaitgraph as gg
from gaitgraph import plots
from gaitgraph.angles import HALF_PI, wrapped
from gaitgraph.explorer.queries import diagram_of
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.plots.axes import BLUE, GREY, PALETTE, RED
from gaitgraph.plots.figures import draw
from gaitgraph.plots.gaits import draw_robustness
from gaitgraph.surface.sheets import PLANE_TYPES
from tests.samples import (
    BEETLE,
    EXACT,
    PUBLISHED,
    by_vehicle,
    cases,
    gait_of_paper,
    on_red,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP = math.pi / 16
GAIT3 = gait_of_paper(3)
physics = gg.invertibility


@pytest.fixture
def ax() -> Axes:
    return Figure().add_subplot()


def scatters(ax: Any) -> list[Any]:
    return [drawn for drawn in ax.collections if isinstance(drawn, PathCollection)]


def color_of(scatter: Any) -> str:
    """Return the color of marks, which grey and hollow ones have on their edge."""
    face = scatter.get_facecolor()
    return to_hex(face[0] if len(face) else scatter.get_edgecolor()[0])


def points_in_space(name: str, **options: Any) -> dict[str, np.ndarray]:
    """Return the points of each color in a figure of the paper, sorted."""
    (space,) = draw(name, **options).axes
    layers: dict[str, list[np.ndarray]] = {}
    for drawn in scatters(space):
        points = np.ma.getdata(np.column_stack(drawn._offsets3d))
        layers.setdefault(color_of(drawn), []).append(points)
    return {
        color: np.unique(np.concatenate(parts), axis=0)
        for color, parts in layers.items()
    }


def lines_of(ax: Axes, gid: str) -> list[np.ndarray]:
    return [np.asarray(line.get_xydata()) for line in ax.lines if line.get_gid() == gid]


def legend_of(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


# Roots on the grid, as Figures 2 to 14 draw them


@pytest.mark.parametrize(("name", "over", "shift"), [("7", 0, 2), ("8", 1, -2)])
def test_both_roots_lie_on_two_planes(name: str, over: int, shift: int) -> None:
    points = points_in_space(name)
    red, blue = points[RED], points[BLUE]
    assert len(red) == len(blue) == 225
    assert red[:, 2] == pytest.approx(red[:, over])
    height = wrapped(shift * PUBLISHED.delta - blue[:, over])
    assert blue[:, 2] == pytest.approx(height)


def test_signed_roots_are_those_with_a_sign_of_r() -> None:
    """With exact coefficients those of blue are grey, R = 0."""
    count = grey = 0
    for name in ("13", "14"):
        points = points_in_space(name)
        third, fourth = points[RED], points[BLUE]
        alpha = np.column_stack([third, fourth[:, 2]])
        assert third[:, :2] == pytest.approx(fourth[:, :2])
        assert physics.roll_sensitivity(alpha, PUBLISHED) == pytest.approx(0, abs=1e-12)
        assert (physics.level_determinant(alpha, PUBLISHED) < 0).all()
        count += len(alpha)
        grey += len(points_in_space(name, coefficients="exact")[GREY])
    assert (count, grey) == (294, 2 * 225)


# Types and the rule


def test_the_lines_of_the_rule_are_the_rule(ax: Axes) -> None:
    plots.adjacency_rule("pair", ax=ax)
    names = [label for label in PLANE_TYPES if label != "(?,?)"]
    allowed = gg.surface.types_may_be_adjacent
    expected = {frozenset(pair) for pair in combinations(names, 2) if allowed(*pair)}
    assert {frozenset(str(line.get_gid()).split()) for line in ax.lines} == expected


def test_type_map_of_the_paper(ax: Axes) -> None:
    """97 nodes have red and blue, 100 blue alone, 28 none; marks and written types share the 225 nodes."""
    plots.type_map(ax=ax)
    shown: dict[Any, list[str]] = {}
    kinds = {"yes yes": ["(+,+)", "(-,-)"], "no yes": ["(-,-)"], "no no": []}
    for drawn in ax.lines:
        assert drawn.get_marker() == "o"  # no node is red alone
        steps = (np.asarray(drawn.get_xydata()) + HALF_PI) / STEP
        for node in steps.round().astype(int).tolist():
            shown[tuple(node)] = kinds[str(drawn.get_gid())]
    written: dict[Any, list[str]] = {}
    for text in ax.texts:
        i, j = map(int, str(text.get_gid()).split(","))
        written.setdefault((i, j), []).append(text.get_text().replace("−", "-"))
    assert not shown.keys() & written.keys()
    shown |= written
    nodes = gg.surface_graph("negative").nodes
    assert len(shown) == 225
    for (i, j), types in shown.items():
        names = (f"{i:03} {j:03} {color}" for color in ("red", "blue"))
        assert types == [nodes[name]["types"] for name in names if name in nodes]
    counts = [len(types) for types in shown.values()]
    assert [counts.count(number) for number in (2, 1, 0)] == [97, 100, 28]
    assert legend_of(ax)[0] == "(+,+): $R < 0$, (−,−): $R < 0$"


# Gaits


@pytest.mark.parametrize("angles", [(1, 2), (4, 2)])
def test_gait_loop_is_the_projection(ax: Axes, angles: tuple[int, int]) -> None:
    plots.gait_loop(GAIT3, angles=angles, label="Gait 3", ax=ax)
    (line,) = ax.lines
    columns = [angle - 1 for angle in angles]
    ring = np.vstack([GAIT3.alpha, GAIT3.alpha[:1]])[:, columns]
    assert np.asarray(line.get_xydata()) == pytest.approx(ring)
    assert (line.get_color(), line.get_label()) == (RED, "Gait 3")
    (arrow,) = ax.texts
    assert isinstance(arrow, Annotation)
    ahead = np.subtract(arrow.xy, arrow.xyann)
    side = ring[1] - ring[0]
    assert ahead @ side == pytest.approx(math.hypot(*ahead) * math.hypot(*side))


def test_roll_pitch_diagram_draws_zeros_of_formula_1(ax: Axes) -> None:
    plots.roll_pitch_diagram(GAIT3, bias=0.8, name="Gait 3", count=12, ax=ax)
    biased = GAIT3.biased(0.8).parametrize(law="constant-speed")
    curves = lines_of(ax, "singular")
    for alpha, points in zip(biased.at(np.arange(12) / 12).alpha, curves, strict=True):
        value = physics.determinant(alpha, EXACT, *points.T)
        assert np.abs(value).max() < 1e-9
    full, part = (patch for patch in ax.patches if patch.get_gid() == "acceptable")
    assert np.ptp(full.get_path().vertices, axis=0) == pytest.approx(math.pi)
    (level,) = (line for line in ax.lines if line.get_marker() == "+")
    assert np.asarray(level.get_xydata()).tolist() == [[0, 0]]
    (border,) = lines_of(ax, "border")  # without the sides of the square
    assert (np.abs(border[1:-1]) < HALF_PI - 1e-9).all()
    assert np.abs(border).max() == pytest.approx(HALF_PI, abs=1e-4)
    assert part.get_path().contains_points(0.99 * border).all()
    assert legend_of(ax) == [
        "Gait 3:\nno singular attitude",
        "Gait 3, $\\eta$ = 0.8:\n85.15 % acceptable",
    ]


VERDICTS = [
    (gait_of_paper(1, "exact"), "singular at every attitude"),
    (gg.lift([(0.5, 0.5), (0.6, -0.6)], "red"), "singular in level flight"),
    (GAIT3, "no singular attitude"),
    (GAIT3.biased(0.8), "85.15 % acceptable"),
]


@pytest.mark.parametrize(("gait", "verdict"), VERDICTS)
def test_pictures_reports_and_the_page_say_the_same_of_a_gait(
    ax: Axes, gait: gg.Gait, verdict: str
) -> None:
    report = gg.robustness_of(gait)
    assert f"the gait itself: {verdict}" in str(report)
    assert report.as_mapping()["verdict"] == verdict
    assert diagram_of(report.gait)["verdict"] == verdict
    plots.roll_pitch_diagram(gait, ax=ax)
    assert legend_of(ax) == [f"gait:\n{verdict}"]
    is_hatched = any(patch.get_hatch() for patch in ax.patches)
    assert is_hatched == (verdict == "singular at every attitude")


def test_a_scaled_gait_has_a_name_of_its_own(ax: Axes) -> None:
    draw_robustness(ax, gg.robustness_of(GAIT3, scale=0.5, curves=3), "Gait 3")
    assert legend_of(ax)[1].startswith("Gait 3, scaled by 0.5:")


# Regions


@by_vehicle(gg.PAPER, BEETLE, gg.Vehicle(drag_ratio=1.5))
def test_regions_map(ax: Axes, vehicle: gg.Vehicle) -> None:
    plots.regions_map(vehicle, ax=ax)
    exact = physics.coefficients_of(vehicle, "exact")
    tolerance = 1e-3 * exact.form.size[2]

    def R(path: Any) -> Any:
        return physics.level_determinant(np.tile(path.vertices, 2), exact)

    drawn: Any = list(ax.collections)
    negative, positive = drawn[0].get_paths()
    assert R(negative).max() <= tolerance
    assert R(positive).min() >= -tolerance
    for curve in drawn:
        if curve.get_zorder() == 4:
            assert np.abs(R(*curve.get_paths())).max() < tolerance
    hatched = [part.get_paths()[0].vertices for part in drawn if part.get_gid()]
    first, second = [(part.min(axis=0) + part.max(axis=0)) / 2 for part in hatched]
    for point in (first, second):
        shares = physics.hover_thrust_shares(np.tile(point, 2), vehicle)
        assert shares.min() > 0
        across = [first[0] + second[0] - point[0], point[1]]
        assert physics.hover_thrust_shares(np.tile(across, 2), vehicle).min() <= 0


@by_vehicle(gg.PAPER, BEETLE, gg.Vehicle(drag_ratio=1.25))
def test_singular_value_map(ax: Axes, vehicle: gg.Vehicle) -> None:
    plots.singular_value_map(vehicle, ax=ax)
    filled: Any = ax.collections[0]
    lines: Any = ax.collections[1]
    axis = np.linspace(-HALF_PI, HALF_PI, 61)
    values = least_singular_value(on_red(*np.meshgrid(axis, axis)), vehicle)
    assert filled.levels[0] == 0
    assert filled.levels[-1] >= values.max()  # no holes
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        places = np.asarray(path.vertices)
        found = least_singular_value(on_red(*places.T), vehicle)
        assert found == pytest.approx(level, abs=0.02)


@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
@pytest.mark.parametrize("angle", [0.0, -2.0])
def test_figure_1_shows_what_forces_do(ax: Axes, spin: Any, angle: float) -> None:
    """A rotor that turns counter-clockwise pushes up with w > 0."""
    vehicle = gg.PAPER.replace(first_rotor_spin=spin, first_arm_angle=angle)
    plots.vehicle_figure(vehicle, ax=ax)
    upward = np.sign(physics.control_force_matrix(np.zeros(4), vehicle)[2])
    force = physics.control_force_matrix([0.1] * 4, vehicle) * upward
    arrows = {str(text.get_gid()): text for text in ax.texts}
    words = [text.get_text() for text in ax.texts]
    for k in range(4):
        arrow: Any = arrows[f"lean {k + 1}"]
        right, up = np.subtract(arrow.xy, arrow.xyann)
        ahead = np.array([up, -right])  # x up the page, y to the left
        across = force[:2, k]
        cosine = ahead @ across / np.linalg.norm(ahead) / np.linalg.norm(across)
        assert cosine == pytest.approx(1)
        assert f"{k + 1}\n{'ccw' if upward[k] > 0 else 'cw'}" in words


# What drawing leaves alone


@pytest.mark.parametrize(
    "draw",
    [
        plots.vehicle_figure,
        plots.adjacency_rule,
        plots.type_map,
        plots.regions_map,
        plots.singular_value_map,
        plots.servo_margin_map,
        lambda ax=None: plots.gait_loop(GAIT3, ax=ax),
        lambda ax=None: plots.roll_pitch_diagram(GAIT3, count=4, ax=ax),
    ],
)
def test_plots_draw_on_given_axes_or_one_new_figure(
    ax: Axes, draw: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitgraph.plots.planes._MARGINS", 9)
    before = dict(mpl.rcParams)
    assert draw(ax=ax) is ax
    assert pyplot.get_fignums() == []
    assert dict(mpl.rcParams) == before
    assert draw().figure is pyplot.figure(1)
    for wrong in (Figure().add_subplot(projection="3d"), Figure()):
        with pytest.raises(gg.InputError, match=r"^ax must be None or .*, got "):
            draw(ax=wrong)


# Full protanopia and deuteranopia by Machado, Oliveira and Fernandes (2009), and what all others see.
EYES = np.reshape(
    [
        *np.eye(3).ravel(),
        *(0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216),
        *(-0.003882, -0.048116, 1.051998),
        *(0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413),
        *(-0.011820, 0.042940, 0.968881),
    ],
    (3, 3, 3),
)
# Of linear red, green and blue, over those of white.
XYZ = [[0.4339, 0.3762, 0.1899], [0.2126, 0.7152, 0.0722], [0.0177, 0.1095, 0.8727]]


def lab(color: str, eye: Any) -> np.ndarray:
    """Return a color in CIELAB as an eye sees it."""
    levels = np.array(mpl.colors.to_rgb(color))
    linear = ((levels + 0.055) / 1.055) ** 2.4
    linear[levels <= 0.04045] = levels[levels <= 0.04045] / 12.92
    seen = np.clip(eye @ linear, 0, 1)
    x, y, z = np.cbrt(np.maximum(XYZ @ seen, 0.00886))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize(
    "names",
    """
alpha1 alpha2 alpha3 alpha4
shade-positive shade-negative
yes partly no
red blue
red yes
red no
blue yes
""".strip().splitlines(),
)
def test_colors_differ_for_all_eyes_on_light_and_dark(names: str) -> None:
    for name, other in combinations(names.split(), 2):
        for color, second in zip(PALETTE[name], PALETTE[other], strict=True):
            for eye in EYES:
                distance = np.linalg.norm(lab(color, eye) - lab(second, eye))
                assert distance > 19


def test_the_explorer_has_the_same_colors() -> None:
    style = Path(gg.__file__).parent / "explorer" / "page" / "style.css"
    text = style.read_text(encoding="utf-8")
    for name, (light, dark) in PALETTE.items():
        assert f"--{name}: light-dark({light}, {dark});" in text


# Pictures of objects

BAR = [(-0.9, 0.3), (-0.7, 0.3), (-0.7, 0.6), (-0.9, 0.6)]
CORNERS = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]
REFUSED = [(0.5, 0.5), (0.2, 0.7)]


@pytest.mark.parametrize(
    ("shown", "legend"),
    cases(r"""
GAIT3 | flyable, $R<0$; $R=0$; all upright; gait, red
gait_of_paper(2) | valid, $R=0$ in exact physics; gait, blue
GAIT3.biased(0.8) | gait, off the surfaces
GAIT3.parametrize() | $\alpha_1$; $\alpha_2$; $\alpha_3$; $\alpha_4$
gg.plan_loop(CORNERS, keep_out=[BAR]) | flyable, $R>0$; $R=0$; all upright; keep out; gait, red; waypoints
gg.plan_loop(REFUSED, sign="negative") | flyable, $R<0$; $R=0$; all upright; waypoints
gg.validate(gait_of_paper(2)) | none
gg.PAPER | none
"""),
)
def test_objects_draw_themselves_whole(shown: str, legend: str, ax: Axes) -> None:
    drawn = eval(shown).plot()
    figure: Any = drawn.figure
    figure.canvas.draw()
    tight = figure.get_tightbbox()
    assert figure.get_size_inches() == pytest.approx([6.0, 5.0])
    assert 0 <= tight.x0 < tight.x1 <= 6.02
    assert 0 <= tight.y0 < tight.y1 <= 5.02
    assert eval(shown).plot(ax=ax) is ax
    assert drawn.get_title()
    if legend != "none":
        assert "; ".join(legend_of(drawn)) == legend
    upright = [line for line in drawn.lines if line.get_label() == "all upright"]
    assert all(line.get_xydata().tolist() == [[0, 0]] for line in upright)


def test_a_plan_without_a_loop_has_arrows_to_the_nearest_admissible_points() -> None:
    ax = gg.plan_loop(REFUSED, sign="negative").plot()
    arrows = [text for text in ax.texts if isinstance(text, Annotation)]
    assert [arrow.xyann for arrow in arrows] == REFUSED
    assert gg.admissible_region(sign="negative").contains([arrows[0].xy]).all()


def test_a_report_is_the_used_part_of_each_limit() -> None:
    ax = gg.validate(gait_of_paper(2)).plot()
    bars: list[Any] = list(ax.patches)
    assert max(bar.get_width() for bar in bars) == 1.5  # beyond its limit
    marks = [label.get_text()[-1] for label in ax.get_yticklabels()]
    assert "".join(marks) == "✓✓✓✓?✗✗"


@pytest.mark.parametrize(
    ("call", "said"),
    cases("""
plots.type_map(1) | sign must be
plots.adjacency_rule("loop") | of must be
plots.gait_loop(GAIT3, angles=(0, 1)) | angles
plots.roll_pitch_diagram(GAIT3, count=0) | count must be
plots.plot(3) | only gaits, tables, plans, .*, got 3
"""),
)
def test_wrong_values_are_refused(call: str, said: str) -> None:
    with pytest.raises(gg.InputError, match=f"^{said}"):
        eval(call)

"""The names that the column "shown by" of docs/reproduction.md uses; each function computes one entry or column."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

import gaitgraph as gg
from gaitgraph.angles import wrapped
from gaitgraph.invertibility.coefficients import paper_form
from gaitgraph.invertibility.forms import Sines
from tests.published import GAITS

if TYPE_CHECKING:
    import networkx as nx
    from numpy.typing import ArrayLike, NDArray

    from gaitgraph.invertibility import Coefficients

    Floats = NDArray[np.float64]

four = gg.invertibility.coefficients_of(kind="published")
exact = gg.invertibility.coefficients_of(kind="exact")
level_determinant = gg.invertibility.level_determinant
roll_sensitivity = gg.invertibility.roll_sensitivity
pitch_sensitivity = gg.invertibility.pitch_sensitivity
least_singular_value = gg.invertibility.least_singular_value
control_force_matrix = gg.invertibility.control_force_matrix
decoupling_matrix = gg.invertibility.decoupling_matrix
types_may_be_adjacent = gg.surface.types_may_be_adjacent

step = np.pi / 16
grid = np.arange(-8, 9) * step
inner = grid[1:-1]
count = gg.surface.root_arrays(grid[:, None], grid[None, :]).count
corners = count[::16, ::16]
sides = np.concatenate([count[::16, 1:-1].ravel(), count[1:-1, ::16].ravel()])
middle = count[1:-1, 1:-1]
roots = gg.surface.root_arrays(inner[:, None], inner[None, :]).alpha
red_root, blue_root = roots[..., 0, :], roots[..., 1, :]  # (15, 15, 4)
exact_blue = gg.surface.root_arrays(
    inner[:, None], inner[None, :], coefficients=exact
).alpha[..., 1, :]
red = level_determinant(red_root, four)
blue = level_determinant(blue_root, four)
blue_judged_exactly = level_determinant(blue_root, exact)
i, j = np.indices(red.shape) - 7  # α1 = i·π/16, α2 = j·π/16
upper = j - i >= 2  # the paper's triangle for R > 0
lower = (i <= 6) & (j >= -6) & (j <= i)  # its triangle for R < 0
some_negative = (red < 0) | (blue < 0)
both_negative = (red < 0) & (blue < 0)
positive, negative = gg.surface_graph("positive"), gg.surface_graph("negative")
exact_negative = gg.surface_graph("negative", coefficients=exact)

points = {1: [(5, 2), (5, 6), (1, 6), (1, 2)], 2: [(6, -6), (6, -2), (2, -2), (2, -6)]}
points |= {3: points[2], 4: [(-2, 2), (-2, 6), (-6, 6), (-6, 2)]}  # multiples of π/16
colors = {gait.number: gait.color for gait in GAITS}
printed = {
    gait.number: np.hstack([np.array(gait.angles), np.array(gait.printed)])
    for gait in GAITS
}
vertices = np.vstack(list(printed.values()))
gaits = {
    k: gg.lift(np.array(points[k]) * step, colors[k], coefficients=four) for k in points
}
rng = np.random.default_rng(0)
alpha = rng.uniform(-np.pi / 2, np.pi / 2, (1000, 4))
roll, pitch = rng.uniform(-1.4, 1.4, (2, 1000))


def types(graph: nx.Graph[Any], color: str | None = None) -> str:
    """Return the plane types in a graph, of one color or of both."""
    seen = {
        data["types"]
        for _, data in graph.nodes(data=True)
        if color in (None, data["color"])
    }
    return ", ".join(sorted(seen))


def types_in_upper() -> str:
    """Return the plane types of the red roots with R > 0 in the paper's triangle."""
    seen = {
        data["types"]
        for node, data in positive.nodes(data=True)
        if data["color"] == "red" and is_in(upper, node)
    }
    return ", ".join(sorted(seen))


def is_in(triangle: NDArray[np.bool_], node: str) -> bool:
    return bool(triangle[int(node[:3]) - 1, int(node[4:7]) - 1])


def mixed_nodes() -> int:
    """Count the nodes of the types (+,−) and (−,+)."""
    return sum(
        data["types"] in {"(+,-)", "(-,+)"}
        for graph in (positive, negative)
        for _, data in graph.nodes(data=True)
    )


def corners_in(triangle: NDArray[np.bool_], number: int) -> int:
    """Count the corners of a gait in a triangle."""
    return sum(bool(triangle[a + 7, b + 7]) for a, b in points[number])


def margin(gait: gg.Gait, **scaled: float) -> str:
    """Return the least tilt margin in exact physics over the period of a gait, or of the gait scaled."""
    report = gg.robustness_of(gait, tilt=0, curves=0, tolerance=0.1, **scaled)  # type: ignore[arg-type]
    margins = (report.gait, *report.sweep)[-1].tilt_margin
    return "none" if margins is None else f"{math.degrees(margins):.2f}°"


def margin_at(*angles: float) -> str:
    """Return the exact tilt margin at four tilt angles."""
    return f"{math.degrees(gg.invertibility.tilt_margin(angles, exact)):.2f}°"


def margins(number: int, *etas: float) -> list[str]:
    """Return the margins of a gait that is biased by each η."""
    return [margin(gaits[number], bias=eta) for eta in etas]


def lifting_inputs() -> list[int]:
    return [int(force) for force in np.sign(control_force_matrix([0, 0, 0, 0])[2])]


def exact_numbers() -> str:
    numbers = (exact.attitude, exact.single, exact.double, exact.triple)
    return ", ".join(f"{number:.6f}" for number in numbers)


def determinant_in_hover() -> float:
    return float(gg.invertibility.determinant([0, 0, 0, 0], four, roll=0.0, pitch=0.0))


def R_in_hover() -> float:
    return float(level_determinant([0, 0, 0, 0], four))


def kappas_that_fit() -> tuple[float, float]:
    """Return the least and the largest κ for which each of the four numbers rounds to the printed one."""
    ranges = (
        [math.hypot(a, 1) - a for a in (2.8805, 2.8795)],
        [(math.sqrt(b * b + 8) - b) / 4 for b in (5.5925, 5.5915)],
        [math.sqrt(1 - c) for c in (0.97165, 0.97155)],
        [0.16865, 0.16875],
    )
    low = max(least for least, _ in ranges)
    high = min(largest for _, largest in ranges)
    return round(low, 6), round(high, 6)


def determinant_off() -> Floats:
    """Return the differences of the determinant over its constant from (1), corrected."""
    paper = gg.PAPER
    assert paper.arm_length is not None
    assert paper.thrust_coefficient is not None
    assert paper.mass is not None
    assert paper.inertia is not None
    constant = -2 * paper.drag_ratio * paper.thrust_coefficient**4 * paper.arm_length**3
    scale = constant / (paper.mass * np.prod(paper.inertia) * np.cos(pitch))
    matrix = decoupling_matrix(alpha, paper, roll, pitch)
    formula = gg.invertibility.determinant(alpha, exact, roll, pitch)
    return np.asarray(np.linalg.det(matrix) / scale - formula)


def linear_form_off() -> Floats:
    """Return the differences of (1) from its form in Rθ, Rφ and R."""
    total = (
        pitch_sensitivity(alpha, exact) * np.sin(pitch)
        + roll_sensitivity(alpha, exact) * np.sin(roll) * np.cos(pitch)
        + level_determinant(alpha, exact) * np.cos(roll) * np.cos(pitch)
    )
    return np.asarray(total - gg.invertibility.determinant(alpha, exact, roll, pitch))


def residuals() -> list[Floats]:
    """Return (7) and (8) at the roots of the closed form."""
    return [
        function(root, four)
        for root in (red_root, blue_root)
        for function in (roll_sensitivity, pitch_sensitivity)
    ]


def bound(values: ArrayLike) -> str:
    """Return the least power of ten, 1e-10 or more, that no value reaches."""
    largest = np.abs(values).max()
    return next(f"1e-{n}" for n in range(10, -1, -1) if largest < 10.0**-n)


def term(function: Any, word: str) -> str:
    """Return one coefficient and its product, given as a word of four letters, such as "sccs"."""
    place = [np.pi / 2 if letter == "s" else 0.0 for letter in word]
    product = " ".join(f"{letter}{n}" for n, letter in enumerate(word, start=1))
    return f"{function(place, exact):+#.4g} {product}"


def R_theta(angles: Floats) -> tuple[Floats, Floats]:
    """Return (5) corrected, and as printed."""
    s, c = np.moveaxis(np.sin(angles), -1, 0), np.moveaxis(np.cos(angles), -1, 0)
    corrected = pitch_sensitivity(angles, four)
    return corrected, corrected - four.attitude * c[0] * c[1] * s[3] * (c[2] - s[2])


def R(angles: Floats) -> tuple[Floats, Floats]:
    """Return (6) corrected, and as printed."""
    s, c = np.moveaxis(np.sin(angles), -1, 0), np.moveaxis(np.cos(angles), -1, 0)
    corrected = level_determinant(angles, four)
    exchanged = s[0] * c[1] * (s[2] * c[3] - c[2] * s[3])
    return corrected, corrected + (four.double + 2) * exchanged


def largest_R_theta() -> list[str]:
    return digits(*(np.abs(values).max() for values in R_theta(vertices)))


def red_nodes(where: Any) -> list[int]:
    return [(where & (values > 0)).sum() for values in R(red_root)]


def negative_blue_nodes() -> list[int]:
    return [(values < 0).sum() for values in R(blue_root)]


def roots_by_place() -> list[list[int]]:
    """Return how many roots the nodes inside, on the sides and in the corners have, and how many nodes these are."""
    places = (middle, sides, corners)
    return [
        [root for place in places for root in np.unique(place)],
        [place.size for place in places],
    ]


def slopes_of_planes() -> list[Floats]:
    """Return the slopes of α3 on red and blue, and those of α4."""
    return [slopes(sheet, angle) for angle in (2, 3) for sheet in (red_root, blue_root)]


def slopes(sheet: Floats, angle: int) -> Floats:
    """Return the slopes of α3 by α1 (angle 2) or of α4 by α2 (3), but for the row that is shifted by π."""
    angles = sheet[1:, :, 2] if angle == 2 else sheet[:, :-1, 3].T
    return np.unique((np.diff(angles, axis=0) / step).round(9))


def shifted_nodes(angle: int) -> int:
    """Count the blue nodes whose α3 (angle 2) or α4 (3) is shifted by π."""
    turn = 2 * four.delta if angle == 2 else -2 * four.delta
    sums = blue_root[..., angle] + blue_root[..., angle - 2]
    return int((np.abs(sums - turn) > 1).sum())


def to_crossing() -> float:
    return round(step - exact.delta, 4)


def between_planes() -> float:
    return round(2 * (step - exact.delta), 4)


def exact_nodes_in_lower() -> int:
    return sum(is_in(lower, node) for node in exact_negative)


def roots_in_lower() -> NDArray[np.int64]:
    return np.unique(((red < 0).astype(int) + (blue < 0))[lower])


def digits(*values: float) -> list[str]:
    return [f"{value:.4f}" for value in values]


def lines(*names: str) -> str:
    """Return the pairs of different types that may be neighbours."""
    pairs = itertools.combinations(names, 2)
    return "; ".join(f"{a}–{b}" for a, b in pairs if types_may_be_adjacent(a, b))


def six_types() -> int:
    """Count the lines among the six types without (?,?)."""
    names = ("(+,+)", "(-,-)", "(+,?)", "(?,+)", "(-,?)", "(?,-)")
    return len(lines(*names).split("; "))


def neighbours(name: str) -> int:
    """Count the types that may be neighbours of one, itself too."""
    return sum(
        types_may_be_adjacent(name, other) for other in types(negative).split(", ")
    )


def nodes_of(name: str, color: str) -> set[str]:
    """Return the nodes whose root of a color has R < 0 and these types."""
    return {
        node[:7]  # "014 002" of "014 002 red"
        for node, data in negative.nodes(data=True)
        if (data["types"], data["color"]) == (name, color)
    }


plus, minus = nodes_of("(+,+)", "red"), nodes_of("(-,-)", "blue")


def R_on_blue() -> list[str]:
    return [f"{blue.min():.1e}", f"{blue.max():.1e}"]


def exact_colors() -> str:
    return ", ".join(sorted(set(colors_in_exact_graph())))


def colors_in_exact_graph() -> list[str]:
    return [data["color"] for _, data in exact_negative.nodes(data=True)]


def blue_nodes(*numbers_of_digits: int) -> list[int]:
    """Count the blue nodes with R < 0 if the coefficients have so many digits, and those of the exact graph."""
    first, second = (one.ravel() for one in np.meshgrid(inner, inner))
    counts = []
    for number in numbers_of_digits:
        numbers = {
            name: float(f"{getattr(exact, name):.{number}g}")
            for name in ("attitude", "single", "double", "triple")
        }
        turn = math.atan2(1, numbers["attitude"])
        angles = [first, second, wrapped(turn - first), wrapped(-turn - second)]
        form = paper_form(list(numbers.values()))
        counts.append(int((form.at(Sines.of(np.column_stack(angles)))[2] < 0).sum()))
    return [*counts, colors_in_exact_graph().count("blue")]


def jumps(
    graph: nx.Graph[Any], first: str, second: str, least: float = 1e-12
) -> Floats:
    """Return by how much α3 and α4 jump along the edges of a graph between two colors, where they do."""
    edges = graph.edges(data=True)
    both = {first, second}
    sizes = [data["jump"] for a, b, data in edges if {a[8:], b[8:]} == both]
    return np.array([jump for jump in sizes if jump >= least])


def changes_of_color() -> list[int]:
    """Count the edges that change the color, and those of them that jump."""
    all_of_them = jumps(negative, "red", "blue", least=0)
    return [all_of_them.size, jumps(negative, "red", "blue").size]


def sizes_of_jumps() -> list[str]:
    sizes = jumps(negative, "red", "blue")
    return digits(sizes.min(), sizes.max())


def is_valid(*loop: tuple[float, float]) -> bool | None:
    return gg.validate(gg.lift(loop, "red")).valid


def flyable_cycles() -> int:
    return sum(1 for _ in gg.cycles(negative, max_length=0.8, require="flyable"))


def worst_singular_value(number: int) -> str:
    return f"{gg.validate(gaits[number])['least_singular_value'].value:.3f}"


def loop_colors(number: int, coefficients: Coefficients) -> str:
    """Return the colors that the loop of a gait can have, with the sign of R."""
    loop = np.array(points[number]) * step
    whole = [
        f"{coloring.colors[0]} ({coloring.sign})"
        for coloring in gg.colorings(loop, coefficients=coefficients)
        if len(set(coloring.colors)) == 1
    ]
    return ", ".join(whole) or "not at all"


def R_along(angles: Floats) -> list[str]:
    """Return the least and the largest R along the straight lines between corners, with four digits."""
    s = np.linspace(0, 1, 2001)[:, None, None]
    steps = np.roll(angles, -1, axis=0) - angles
    values = level_determinant(angles + s * steps, four)
    return [
        f"{value:.2g}" if abs(value) < 0.01 else f"{value:.2f}"
        for value in (values.min(), values.max())
    ]


def farthest_vertex() -> float:
    """Return the largest difference of α3 and α4 from those printed, over the sixteen corners [rad]."""
    differences = []
    for number, loop in points.items():
        plan = gg.plan_loop(
            np.array(loop) * step, color=colors[number], require="valid"
        )
        assert plan.gait is not None
        differences.append(plan.gait.alpha[:, 2:] - printed[number][:, 2:])
    return round(float(np.abs(differences).max()), 4)


def around(gait: Any, coefficients: Any, eta: float = 1.0) -> str:
    """Return the least tilt margin and the acceptable fraction, all digits taken as they stand."""
    (biased,) = gg.robustness_of(
        gait,
        bias=eta,
        tilt=0,
        curves=0,
        coefficients=coefficients,
        angle_rounding=0.0,
    ).sweep
    if biased.tilt_margin is None:
        return "none"
    degrees = math.degrees(biased.tilt_margin)
    return f"{degrees:.2f}°, {100 * biased.acceptable.fraction:.2f} %"


def readings() -> list[list[str]]:
    """Return margins and fractions for each way of rounding, and which of the three claims hold for the fractions."""
    exact_gaits = {k: exact_gait(k) for k in (1, 2)}
    surfaces: list[tuple[Any, str]] = [
        (exact_gaits, "exact"),
        (gaits, "printed"),
        (gaits, "exact"),
        (exact_gaits, "printed"),
        (printed, "exact"),
        (printed, "printed"),
    ]
    table = []
    for surface, formula in surfaces:
        gaits_and_etas = ((1, 1.0), (1, 0.8), (2, 1.0), (2, 0.99), (2, 0.8))
        row = [around(surface[k], formula, eta) for k, eta in gaits_and_etas]
        part = [0.0 if cell == "none" else float(cell.split()[1]) for cell in row]
        claims = [
            part[0] > part[1],  # Figure 18: the gait has the wider region
            part[2] > part[3],  # Figure 19
            0 < part[2] < part[4] + 2,  # Figure 22: at most 2 % of the diagram wider
        ]
        table.append([*row, ", ".join("yes" if holds else "no" for holds in claims)])
    return table


def exact_gait(number: int) -> gg.Gait:
    """Return Gait 1 or 2 on the exact blue sheet."""
    return gg.lift(np.array(points[number]) * step, "blue", coefficients=exact)


def beside_gait_2(*etas: float) -> list[str]:
    """Return the exact margins of Gait 2 biased by each η."""
    angles = exact_gait(2).alpha
    return [around(angles * [1, 1, eta, eta], exact).split(",")[0] for eta in etas]


def moved(third: float, fourth: float) -> list[str]:
    """Return the margins of Gaits 1 and 2 beside the exact blue sheet."""
    move = np.array([0, 0, third, fourth])
    places = [exact_gait(k).alpha + move for k in (1, 2)]
    return [around(angles, exact).split(",")[0] for angles in places]

"""Transitions between hover and gaits: where they end, what they keep, and the proof of refusals."""

from __future__ import annotations

import itertools
import json
import math
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.surface.sheets import red_label, separating_factor
from gaitgraph.timing.laws import LAWS, LawName
from gaitgraph.tolerances import DEFAULT_FLOOR
from tests.published import GAITS
from tests.samples import points_of

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.validation.report import Report

FloatArray = npt.NDArray[np.float64]

G1, G2, G3, G4 = (gg.lift(gait.angles, gait.color) for gait in GAITS)
EXACT = gg.invertibility.coefficients_of(kind="exact")

# A point of each of the seven components of the red sheet (section 10 of theory.md).
SEVEN = (
    (0.0, 0.0),
    (1.0, -1.0),
    (-1.5, 0.0),
    (0.0, 1.5),
    (-1.5, -1.55),
    (1.55, 1.5),
    (-1.5, 1.5),
)


def numbers_of(vehicle: gg.Vehicle) -> gg.Coefficients:
    return gg.invertibility.coefficients_of(vehicle, "exact")


def dense(path: FloatArray) -> FloatArray:
    """Return points along a polyline, its corners included, shape (n, 4)."""
    return points_of(path[:-1], path[1:]).reshape(-1, 4)


def check_flight(
    points: FloatArray, vehicle: gg.Vehicle, sign: float, floor: float = DEFAULT_FLOOR
) -> None:
    """Check the physics at sampled points, without any of the bounds that the planner uses."""
    assert (
        sign * gg.invertibility.level_determinant(points, numbers_of(vehicle)) > 0
    ).all()
    assert (
        gg.invertibility.least_singular_value(points, vehicle) >= floor - 1e-9
    ).all()
    assert (gg.invertibility.hover_thrust_shares(points, vehicle) > 0).all()
    np.testing.assert_array_equal(points[:, 2:], points[:, :2])  # on the red sheet
    determinant = gg.invertibility.determinant(
        points, numbers_of(vehicle), roll=0.3, pitch=-0.2
    )
    assert (sign * determinant > 0).all()


def ends_of(end: gg.Gait | str) -> FloatArray:
    return np.zeros((1, 4)) if isinstance(end, str) else end.alpha


def check_ends(found: gg.planning.Transition, start: Any, end: Any) -> None:
    for number, one, place in zip(found.corners, (start, end), (0, -1), strict=True):
        if isinstance(one, str):
            assert number is None
            np.testing.assert_array_equal(found.path[place], np.zeros(4))
        else:
            assert number is not None
            np.testing.assert_allclose(found.path[place], one.alpha[number], atol=1e-9)


def report_of(found: gg.planning.Transition) -> Report:
    return found.report


# Hover and Gait 4


def pair_of(there: bool, gait: gg.Gait = G4) -> tuple[Any, Any]:
    return ("hover", gait) if there else (gait, "hover")


@pytest.mark.parametrize("there", [True, False], ids=["entry", "exit"])
@pytest.mark.parametrize("samples", [1, 100])
def test_the_table_goes_from_rest_at_one_end_to_rest_at_the_other(
    there: bool, samples: int
) -> None:
    start, end = pair_of(there)
    found = gg.transition(start, end, samples=samples, duration=2.0)
    table = found.table
    np.testing.assert_allclose(table["t"], np.linspace(0, 2.0, samples + 1), atol=1e-15)
    np.testing.assert_array_equal(table.alpha[0], ends_of(start)[0])
    np.testing.assert_allclose(table.alpha[-1], ends_of(end)[0], atol=1e-12)
    for row in (0, -1):
        for k, what in itertools.product(range(1, 5), ("rate", "acceleration")):
            assert abs(table[f"alpha{k}_{what}"][row]) < 1e-9
    check_flight(table.alpha, gg.PAPER, 1.0)
    tau = table["t"] / 2
    progress = 10 * tau**3 - 15 * tau**4 + 6 * tau**5
    expected = found.path[0] + progress[:, None] * (found.path[-1] - found.path[0])
    np.testing.assert_allclose(table.alpha, expected, atol=1e-12)
    numbers = [None if corner is None else corner + 1 for corner in found.corners]
    assert list(table.about["transition"].values()) == numbers
    assert (table.about["period"], found.duration, table.about["law"]) == (
        2.0,
        2.0,
        "smooth",
    )


def test_written_and_read_back_bit_for_bit(tmp_path: Path) -> None:
    found = gg.transition("hover", G4, samples=30, duration=1.5)
    found.write(tmp_path / "entry.csv")
    report = gg.validate(tmp_path / "entry.csv")
    assert report["closed"].message.startswith("run once, from row 1 to row 31")
    assert report.warnings == ()
    with pytest.raises(gg.errors.OutputExists):
        found.write(tmp_path / "entry.csv")
    table, expected = gg.read_table(tmp_path / "entry.csv"), found.table
    assert list(table.columns) == list(expected.columns)
    assert all(np.array_equal(table[name], expected[name]) for name in expected.columns)
    with pytest.raises(gg.InputError, match="gait must repeat, got a path"):
        gg.gait_of(table)


def around(
    a1: float, a2: float, radius: float, corners: int = 4, **about: Any
) -> gg.Gait:
    turn = (np.arange(corners) + 0.5) * (2 * pi / corners)
    return gg.lift(
        np.column_stack([a1 + radius * np.cos(turn), a2 + radius * np.sin(turn)]),
        "red",
        **about,
    )


# Where both thrusts push up (section 11 of theory.md), away from the borders: the quadrant of hover, and the other one.
_hovering = st.tuples(st.floats(-1.2, 0.0), st.floats(0.0, 1.2))
_below = st.tuples(st.floats(0.35, 1.35), st.floats(-1.35, -0.35))


@settings(deadline=None, max_examples=20)
@given(
    kappa=st.floats(0.05, 1.0),
    ends=st.tuples(
        st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)),
        st.tuples(_hovering, st.just((0.0, 0.0))),
    ),
    floor=st.floats(0.0, 0.6),
)
def test_whatever_is_answered_holds_for_any_vehicle(
    kappa: float, ends: Any, floor: float
) -> None:
    vehicle = gg.Vehicle(drag_ratio=kappa)
    numbers = numbers_of(vehicle)
    first, last = (
        gg.lift([ends[0]], "red", vehicle=vehicle),
        gg.lift([ends[1][0]], "red", vehicle=vehicle),
    )
    found = gg.transition(first, last, floor=floor)
    signs = [float(np.sign(gait.R[0])) for gait in (first, last)]
    labels = [
        tuple(red_label(gait.alpha[0, 0], gait.alpha[0, 1], vehicle).tolist())
        for gait in (first, last)
    ]
    if not found:
        assert found.reason
        assert (found.proof is not None) == (signs[0] != signs[1])
        assert labels[0] != labels[1] or "not valid" in found.reason
        return
    assert labels[0] == labels[1]
    points = dense(found.path)
    assert (signs[0] * gg.invertibility.level_determinant(points, numbers) > 0).all()
    if report_of(found).flyable:
        check_flight(points, vehicle, signs[0], floor)
    else:
        assert found.reason == report_of(found).reason
    # Unless the straight path would have done.
    straight = dense(np.vstack([first.alpha, last.alpha]))
    flies = (
        gg.invertibility.least_singular_value(straight, vehicle).min() > floor + 1e-4
    )
    flies &= gg.invertibility.hover_thrust_shares(straight, vehicle).min() > 1e-4
    flies &= (
        signs[0] * gg.invertibility.level_determinant(straight, numbers)
    ).min() > 1e-4
    assert not flies or (report_of(found).flyable and len(found.path) == 2)


def test_a_way_from_a_gait_to_itself_is_a_stop_at_a_corner() -> None:
    for gait in (G3, G4):
        found = gg.transition(gait, gait)
        assert found.length == 0
        assert report_of(found).flyable
        assert found.corners[0] == found.corners[1]
        check_ends(found, gait, gait)
        table = found.table
        np.testing.assert_allclose(
            table.alpha, np.broadcast_to(found.path[0], table.alpha.shape), atol=1e-15
        )
    hover = gg.transition("hover", "hover")
    assert hover
    assert (hover.length, hover.corners) == (0, (None, None))
    assert (
        str(hover)
        .splitlines()[0]
        .endswith("smooth, nothing moves; checked there and back")
    )
    np.testing.assert_array_equal(hover.path, np.zeros((2, 4)))


def test_from_the_nearest_corner_to_the_nearest_also_of_more_than_are_tried() -> None:
    small, large = around(-0.7, 0.7, 0.3, 37), around(-0.8, 0.9, 0.2, 60)
    below = around(0.7, -1.0, 0.05, 3), around(1.2, -0.5, 0.05, 5)
    rows = np.array(
        [[-0.4, 0.4, -0.4003, 0.4003], [-0.4, 1.2, -0.4, 1.2], [-1.2, 1.2, -1.2, 1.2]]
    )
    beside = gg.Gait(
        alpha=rows, colors=("red",) * 3
    )  # its first corner is a little off the surface
    assert beside.check().valid
    check_ends(gg.transition("hover", beside), "hover", beside)
    cases: list[tuple[Any, Any]] = [
        ("hover", G4),
        (G4, "hover"),
        ("hover", small),
        (large, small),
        (small, large),
    ]
    for start, end in (*cases, below, below[::-1]):
        found = gg.transition(start, end)
        assert (found.reason, found.proof, report_of(found).flyable) == (
            None,
            None,
            True,
        )
        assert report_of(found).reachable_from_hover is ((start, end) in cases)
        assert found.path.shape == (2, 4)  # nothing is in the way
        check_ends(found, start, end)
        nearest = np.linalg.norm(
            ends_of(start)[:, None, :2] - ends_of(end)[None, :, :2], axis=2
        ).min()
        assert found.length == pytest.approx(nearest, abs=1e-12)
        sign = 1.0 if "hover" in (start, end) else float(np.sign(end.R[0]))
        check_flight(dense(found.path), gg.PAPER, sign)


@pytest.mark.parametrize("ends", [(-0.45, 0.8), (-0.2, 0.9)])
def test_a_bent_path_is_half_the_loop_through_its_ends_in_both_directions(
    ends: tuple[float, float],
) -> None:
    # A little below the curve tan α1 − tan α2 = 2κ, where R < 0.
    points = [
        (a1, math.atan(math.tan(a1) - 2 * gg.PAPER.drag_ratio) - 0.05) for a1 in ends
    ]
    first, last = (gg.lift([point], "red") for point in points)
    there, back = gg.transition(first, last), gg.transition(last, first)
    plan = gg.plan_loop(points, color="red", sign="negative", require="valid")
    assert plan.loop is not None
    assert there.length == pytest.approx(plan.loop.length / 2, abs=1e-9)
    assert there.length > np.linalg.norm((first.alpha - last.alpha)[0, :2])
    np.testing.assert_array_equal(there.path, back.path[::-1])
    np.testing.assert_array_equal(
        there.table.alpha[[0, -1]], np.vstack([first.alpha, last.alpha])
    )
    assert there.corners == back.corners[::-1] == (0, 0)
    check_ends(there, first, last)
    # It leaves the quadrants of positive thrusts, and says so.
    assert report_of(there).valid
    assert not report_of(there)["hover_thrust"].ok
    assert there.reason == report_of(there).reason


def test_a_gait_with_negative_R_is_refused_from_hover_with_a_proof() -> None:
    cases: list[tuple[Any, Any]] = [("hover", G3), (G3, "hover"), (G4, G3), (G3, G4)]
    for start, end in cases:
        found = gg.transition(start, end)
        assert (found.status, found.judged, found.corners) == (
            "infeasible",
            None,
            (None, None),
        )
        assert found.proof is not None
        values = [found.proof["R_start"], found.proof["R_end"]]
        for value, one in zip(values, (start, end), strict=True):
            assert (
                value
                in gg.invertibility.level_determinant(
                    ends_of(one), G4.coefficients
                ).tolist()
            )
            # The exact physics agrees with the sign.
            assert (
                value * gg.invertibility.level_determinant(ends_of(one), EXACT) > 0
            ).all()
            assert f"{value:+.4g}" in str(found.reason)
        assert values[0] * values[1] < 0
        assert "singular" in str(found.reason)
        assert "every flight" in found.proof["statement"]


@settings(deadline=None, max_examples=25)
@given(
    point=_below,
    roll=st.floats(-1.57, 1.57),
    pitch=st.floats(-1.57, 1.57),
    way=st.lists(st.tuples(*[st.floats(-2, 2)] * 6), max_size=4),
)
def test_every_flight_from_hover_to_negative_R_passes_a_singular_matrix(
    point: tuple[float, float], roll: float, pitch: float, way: list[tuple[float, ...]]
) -> None:
    """What the proof says, on arbitrary flights: tilt angles off the surfaces, attitudes of any kind."""
    gait = gg.lift([point], "red")
    proof = gg.transition("hover", gait).proof
    assert proof is not None
    start, end = (
        np.array([0, 0, 0, 0, pitch, roll]),
        np.array([*gait.alpha[0], roll, pitch]),
    )
    flight = np.vstack([start, *way, end]) if way else np.vstack([start, end])
    s = np.linspace(0, 1, 50)[:, None]
    states = np.concatenate(
        [(1 - s) * a + s * b for a, b in itertools.pairwise(flight)]
    )
    value = gg.invertibility.determinant(
        states[:, :4], EXACT, states[:, 4], states[:, 5]
    )
    assert value[0] == pytest.approx(
        proof["R_start"] * math.cos(pitch) * math.cos(roll)
    )
    assert value[0] > 0
    assert value[-1] < 0
    assert (np.diff(np.sign(value)) != 0).any()


@pytest.mark.parametrize(
    ("i", "j"), list(itertools.combinations_with_replacement(range(7), 2))
)
def test_the_seven_components(i: int, j: int) -> None:
    first, last = (gg.lift([SEVEN[k]], "red", coefficients=EXACT) for k in (i, j))
    labels = [red_label(*SEVEN[k]) for k in (i, j)]
    found = gg.transition(first, last)
    assert bool(found) == (i == j)
    if found:
        assert found.gait.coefficients == EXACT
        return
    if labels[0].prod() != labels[1].prod():
        R = [
            float(gg.invertibility.level_determinant(gait.alpha[0], EXACT))
            for gait in (first, last)
        ]
        assert found.proof is not None
        assert [found.proof["R_start"], found.proof["R_end"]] == R
        return
    assert (
        found.proof is None
    )  # off the surface there are ways (section 12 of theory.md)
    assert (
        f"both ends are on the red sheet, separated by {separating_factor(SEVEN[i], SEVEN[j])}"
        in str(found.reason)
    )
    for differs, name in zip(
        labels[0] != labels[1],
        ("line α1 = ", "line α2 = ", "curve tan α1"),
        strict=True,
    ):
        assert (name in str(found.reason)) == differs


def test_blue_to_blue_is_valid_and_not_flyable() -> None:
    printed = [
        np.column_stack([np.round(gait.angles, 3), gait.printed]) for gait in GAITS[:2]
    ]
    rough = gg.transition(
        *(gg.Gait(alpha=rows, colors=("blue",) * 4) for rows in printed)
    )
    assert (bool(rough), rough.reason is not None) == (
        True,
        True,
    )  # printed digits do not turn the sign of blue
    assert not rough or not report_of(rough).flyable
    found = gg.transition(G1, G2)
    report = report_of(found)
    assert (report.valid, report["R_sign"].decided, report.flyable) == (
        True,
        False,
        False,
    )
    assert "the whole blue sheet is singular" in str(found.reason)
    check_ends(found, G1, G2)
    points = dense(found.path)
    assert gg.invertibility.least_singular_value(points).max() < 1e-4  # δ is rounded
    assert (
        gg.invertibility.level_determinant(points, gg.invertibility.coefficients_of())
        < 0
    ).all()
    assert set(found.gait.colors) == {"blue"}
    assert gg.transition(G2, G1).length == pytest.approx(found.length)


EXACT_BLUE = gg.lift(G2.alpha[:, :2], "blue", coefficients=EXACT)
MEETING = ", and the sheets meet in four points only, all with R = 0"
# (−1.5, 1.5) has R > 0 in a small component of its own; where β1 and β2 reach ±π/2 together, R only touches 0.
SADDLES = [
    gg.lift([(-1.5, 1.5)], "red", coefficients=numbers)
    for numbers in (EXACT, G3.coefficients)
]
NOT_VALID = [
    (gg.lift([(0.5, -0.5), (-0.5, 0.5)], "red"), G3, "R changes its sign"),
    (
        gg.Gait(alpha=np.array([[0.4, -0.4, 0.1, -0.2]]), colors=("red",)),
        G3,
        "max(|Rφ|, |Rθ|)",
    ),
    (
        gg.lift(G3.alpha[:, :2], ["red", "blue", "red", "red"]),
        G3,
        "may not be neighbours (Figure 15)",
    ),
    (
        gg.lift([(-1.3, 0.2), (-1.1, 0.2)], "blue"),
        G3,
        "where it wraps by π or leaves its sheet",
    ),  # wraps by π from one end of the range on
    (EXACT_BLUE, EXACT_BLUE, "R = 0 on the whole blue sheet"),
]
NOT_JOINED: list[tuple[Any, Any, str]] = [
    *(
        (gait, other, f"the start is not valid: …{told}")
        for gait, other, told in NOT_VALID
    ),
    *(("hover", gait, f"the end is not valid: …{told}") for gait, _, told in NOT_VALID),
    (G3, G2, f"…the start is red and the end blue{MEETING}"),
    ("hover", G1, f"…the start is red and the end blue{MEETING}"),
    (G1, "hover", f"…the start is blue and the end red{MEETING}"),
    (
        gg.lift([(-3 * pi / 8, 3 * pi / 8)], "blue"),
        G2,
        "…as far as rounded coefficients decide them",
    ),
    *(("hover", corner, "…separated by the line α1") for corner in SADDLES),
]


@pytest.mark.parametrize(
    ("start", "end", "told"), NOT_JOINED, ids=range(len(NOT_JOINED))
)
def test_ends_that_are_not_valid_or_lie_in_different_parts_are_not_joined(
    start: Any, end: Any, told: str
) -> None:
    found = gg.transition(start, end)
    assert not found
    beginning, _, part = told.partition("…")
    assert str(found.reason).startswith(beginning)
    assert part in str(found.reason)
    if beginning:
        wrong = start if "start" in beginning else end
        assert (found.proof, found.reason) == (
            None,
            f"{beginning}{wrong.check().reason}",
        )


def test_a_refusal_has_no_way_and_says_why_wherever_it_is_asked() -> None:
    found = gg.transition("hover", G3)
    for ask in (
        lambda: found.gait,
        lambda: found.path,
        lambda: found.report,
        lambda: found.length,
        lambda: found.timed,
        lambda: found.table,
        lambda: found.write("never.csv"),
    ):
        with pytest.raises(gg.Infeasible) as caught:
            ask()
        assert str(caught.value) == found.reason
    assert found.proof is not None
    assert str(found) == f"No path: {found.reason}\nProof: {found.proof['statement']}."
    told = json.loads(json.dumps(found.as_mapping(), allow_nan=False))
    expected: dict[str, Any] = {
        "status": "infeasible",
        "reason": found.reason,
        "proof": found.proof,
        "length": None,
    }
    expected |= {
        "path": [],
        "colors": [],
        "duration": None,
        "valid": False,
        "flyable": False,
        "checks": [],
    }
    assert told | expected == told


def test_a_transition_as_plain_values_and_in_words() -> None:
    found = gg.transition(G3, around(0.9, -1.0, 0.2, 3), law="equal-time", duration=2.5)
    told = json.loads(json.dumps(found.as_mapping(), allow_nan=False))
    leaves, joins = (corner + 1 for corner in found.corners if corner is not None)
    expected: dict[str, Any] = {
        "status": "planned",
        "reason": None,
        "proof": None,
        "law": "equal-time",
    }
    expected |= {
        "path": found.path.tolist(),
        "colors": ["red"] * len(found.path),
        "length": found.length,
    }
    expected |= {"duration": 2.5, "leaves_corner": leaves, "joins_corner": joins}
    assert (
        told | expected | dict.fromkeys(("valid", "two_color", "flyable"), True) == told
    )
    assert [check["name"] for check in told["checks"]][-1] == "tilt_acceleration"
    assert str(gg.transition("hover", G4)).startswith(
        "From hover to corner 1 (-0.393, 0.393, -0.393, 0.393): 2 corners"
    )


def entry_of(**limits: Any) -> gg.Gait:
    return gg.lift(G4.alpha[:, :2], "red", vehicle=gg.PAPER.replace(**limits))


@pytest.mark.parametrize(
    ("limits", "needed"),
    [
        # From hover to (−π/8, π/8) every angle turns by π/8. The minimum-jerk polynomial 10τ³ − 15τ⁴ + 6τ⁵ has the
        # greatest slope 15/8, at τ = 1/2, and the greatest second derivative 10/√3.
        ({"max_tilt_rate": 0.2}, 15 / 8 * (pi / 8) / 0.2),
        ({"max_tilt_acceleration": 0.5}, math.sqrt(10 / math.sqrt(3) * (pi / 8) / 0.5)),
        (
            {"max_tilt_rate": 0.3, "max_tilt_acceleration": 0.1},
            math.sqrt(10 / math.sqrt(3) * (pi / 8) / 0.1),
        ),
        ({"max_tilt_rate": 5.0, "max_tilt_acceleration": 50.0}, 1.0),
        ({}, 1.0),
    ],
)
def test_the_default_duration_is_what_the_limits_need(
    limits: dict[str, float], needed: float
) -> None:
    start, end = pair_of(len(limits) < 2, entry_of(**limits))
    found = gg.transition(start, end)
    assert needed <= found.duration <= needed + 1.0001e-3  # whole milliseconds
    assert found.reason is None
    report = report_of(found)
    assert report["tilt_rate"].ok
    assert report["tilt_rate"].value == pytest.approx(
        15 / 8 * (pi / 8) / found.duration
    )
    if "max_tilt_acceleration" in limits:
        assert report["tilt_acceleration"].value == pytest.approx(
            10 / math.sqrt(3) * (pi / 8) / found.duration**2
        )
    if needed > 1:
        faster = gg.transition(start, end, duration=0.99 * needed)
        assert (report_of(faster).valid, report_of(faster).flyable) == (True, False)
        assert "limit" in str(faster.reason)
        np.testing.assert_array_equal(faster.path, found.path)


@pytest.mark.parametrize("law", [*LAWS][1:])
def test_the_last_row_does_not_fly_back(law: LawName) -> None:
    table = gg.transition("hover", G4, law=law, samples=4).table
    for k in range(1, 5):
        slope = table[f"alpha{k}"][-1] - table[f"alpha{k}"][-2]
        assert slope * table[f"alpha{k}_rate"][-1] >= 0


def test_samples_and_rate() -> None:
    assert gg.transition("hover", G4).samples == 100
    seventeen = gg.transition("hover", G4, samples=17)
    assert seventeen.samples == 17
    assert len(seventeen.table) == 18
    for samples in (49, 98):  # 49 · (1/49) is below 1 in floating point
        assert gg.transition("hover", G4, samples=samples).table["t"][-1] == 1.0
    for duration, rate in ((2.5, 10.0), (1.0, 33.3), (0.1, 1.0)):
        found = gg.transition("hover", G4, duration=duration, rate=rate)
        assert found.samples == math.ceil(duration * rate - 1e-9)
    # The angle that turns most needs the longest; the rate is per second of that.
    steep = gg.lift([(-0.4, 0.1)], "red", vehicle=gg.PAPER.replace(max_tilt_rate=0.2))
    assert gg.transition("hover", steep).duration == pytest.approx(15 / 8 * 0.4 / 0.2)
    slow = gg.transition("hover", entry_of(max_tilt_rate=0.2), rate=10)
    assert slow.samples == math.ceil(slow.duration * 10) == 37
    for duration in (1e-6, 5e8):
        found = gg.transition("hover", G4, duration=duration, samples=3)
        assert found.timed.period == duration
        assert found.table["t"][-1] == pytest.approx(duration)


def test_the_limits_of_the_vehicle_are_limits_of_the_way() -> None:
    wide = around(-0.9, 0.9, 0.3)
    vehicles = {
        "tilt_range": gg.PAPER.replace(max_tilt=0.5),
        "thrust_limit": gg.PAPER.replace(max_thrust=1.0),
    }
    for name, vehicle in vehicles.items():
        gait = gg.lift(wide.alpha[:, :2], "red", vehicle=vehicle)
        found = gg.transition("hover", gait)
        assert found  # valid all the same
        assert not report_of(found)[name].ok
        assert found.reason == report_of(found)[name].message
        assert not report_of(found).flyable

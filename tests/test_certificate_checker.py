"""The parts of the checker of certificates against exact fractions, and its verdicts at the limits of what is true."""

from __future__ import annotations

import ast
import json
import math
import random
import subprocess
import sys
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from gaitgraph.certificates import check
from gaitgraph.certificates.making import stated_vehicle
from gaitgraph.invertibility.forms import Sines, level_of, rotors_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    zero_moment_direction,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.mutated import changed
from tests.samples import LEANING, symmetric_vehicle

F = Fraction
CHECKER = Path(check.__file__)
ONE = check.ONE
RAISED = PAPER.replace(rotor_height=0.05, first_rotor_spin="counterclockwise")
# Its R would be negative at α = 0 with the sign of the drag of rotor 1.
TURNED = LEANING.replace(
    spins=["counterclockwise", "clockwise", "clockwise", "counterclockwise"]
)
VEHICLES = [PAPER, RAISED, symmetric_vehicle(np.random.default_rng(4)), TURNED]
POINTS = [[0.4, -0.7, 0.4, -0.7], [0.3, 0.5, 0.25, 0.55], [-0.9, 1.1, -0.9, 1.1]]
ZERO, TINY = F(0), F(1, 10**9)


def test_the_checker_needs_the_standard_library_alone() -> None:
    modules = set()
    for node in ast.walk(ast.parse(CHECKER.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            modules.add(node.module)
        elif isinstance(node, ast.Import):
            modules.update(name.name for name in node.names)
    assert modules <= {*sys.stdlib_module_names} - {"random", "decimal"}


# -- Numbers


def ends_of(enclosure: check.Enclosure) -> list[F]:
    return [F(enclosure.low, ONE), F(enclosure.high, ONE)]


def outward(exact: list[F]) -> tuple[int, int]:
    """Return the ends of the least enclosure of exact numbers."""
    return math.floor(min(exact) * ONE), math.ceil(max(exact) * ONE)


def middle(enclosure: check.Enclosure) -> float:
    return (enclosure.low + enclosure.high) / 2 / ONE


def exactly(enclosure: check.Enclosure) -> F:
    assert enclosure.low == enclosure.high
    return F(enclosure.low, ONE)


def random_polynomial(chance: random.Random, degree: int) -> list[F]:
    return [F(chance.randrange(-9, 10), 7) for _ in range(degree + 1)]


def test_enclosures_are_the_least_ones_of_exact_ends() -> None:
    chance = random.Random(1)
    enclosures = []
    for bits in (3, 60, 97) * 12:
        ends = sorted(chance.randrange(-(2**bits), 2**bits) for _ in range(2))
        enclosures.append(check.Enclosure(*ends))
    for one, other in product(enclosures, enclosures):
        pairs = [*product(ends_of(one), ends_of(other))]
        assert one + other == outward([a + b for a, b in pairs])
        assert one - other == outward([a - b for a, b in pairs])
        assert one * other == outward([a * b for a, b in pairs])
    for one in enclosures:
        assert F(one.size(), ONE) == max(map(abs, ends_of(one)))
        if one.low > 0:
            assert one.inverse() == outward([1 / end for end in ends_of(one)])
    assert (check.NONE, ONE, exactly(check.HALF)) == ((0, 0), 2**96, F(1, 2))


def test_numbers_and_roots_are_enclosed_to_one_unit() -> None:
    chance = random.Random(2)
    for _ in range(300):
        number = F(chance.randrange(-(10**9), 10**9), chance.randrange(1, 10**6))
        assert check.enclosed(number) == outward([number])
        assert check.enclosed(number.numerator) == outward([F(number.numerator)])
        low, high = check.root(abs(number))
        assert high == low + 1
        assert F(low, ONE) ** 2 <= abs(number) < F(high, ONE) ** 2
    assert check.root(F(9, 4)).low == 3 * ONE // 2


def test_turns_enclose_cosine_and_sine() -> None:
    angles = [F(k, 97) for k in range(-388, 389, 31)]
    with mpmath.workprec(300):
        for angle in [*angles, F(0), F(4), F(-4), F(1, 10**40)]:
            exact = mpmath.mpf(angle.numerator) / angle.denominator
            values = mpmath.cos(exact), mpmath.sin(exact)
            for enclosure, value in zip(check.turn_by(angle), values, strict=True):
                assert enclosure.low <= value * ONE <= enclosure.high
                assert enclosure.high - enclosure.low <= 400
    assert check.turn_by(F(0)) == [(ONE, ONE), (0, 0)]
    for angle in (F(4) + F(1, 10**30), F(-5)):
        with pytest.raises(ValueError, match="angles must be at most 4 rad in size"):
            check.turn_by(angle)


def test_polynomials_are_moved_and_written_in_bernstein_form_exactly() -> None:
    chance = random.Random(5)
    origin, unit = F(1, 5), F(3, 4)
    for degree in (0, 1, 2, 3, 6):
        curve = random_polynomial(chance, degree)
        moved = check.moved(curve, origin, unit)
        points = check.bernstein(curve)
        assert len(points) == degree + 1
        for x in (F(-1), F(0), F(1, 3), F(1)):
            value = sum(a * x**k for k, a in enumerate(curve))
            assert check.value_at(curve, x) == value
            there = check.value_at(curve, origin + unit * x)
            assert check.value_at(moved, x) == there
            of_points = sum(
                math.comb(degree, k) * x**k * (1 - x) ** (degree - k) * point
                for k, point in enumerate(points)
            )
            assert of_points == value


def test_bounds_of_derivatives_are_rounded_up() -> None:
    curve = [F(9), F(-1, 3), F(2), F(-5), F(7)]
    third = F(math.ceil(F(ONE, 3)), ONE)
    assert exactly(check.bound(curve, 0)) == third + 9 + 2 + 5 + 7
    assert exactly(check.bound(curve, 1)) == third + 2 * 2 + 3 * 5 + 4 * 7
    assert exactly(check.bound(curve, 2)) == 2 * 2 + 6 * 5 + 12 * 7


# -- Level flight


def level_of_checker(vehicle: Vehicle) -> check.Level:
    return check.Level(stated_vehicle(vehicle))


def piece_of(level: Any, curves: list[list[F]], duration: int = 1) -> check.Piece:
    return check.Piece({"alpha": curves, "duration": F(duration)}, level)


def still_arc(vehicle: Vehicle, alpha: list[float]) -> check.Arc:
    piece = piece_of(level_of_checker(vehicle), [[F(angle)] for angle in alpha])
    return check.Arc(piece, F(0), F(0))


SPIN_WORDS = {1: "clockwise", -1: "counterclockwise"}
PLACES: list[list[Any]] = [[3, 4, 1], [-8, 6, -2], [-3, -4, 1], [8, -6, -2]]
# They need not be unit vectors, nor the thrust axes across the tilt axes.
TILTS: list[list[Any]] = [[3, 4, 1], [-1, 2, 2], [-9, -11, 4], [5, -3, F(-1, 7)]]
THRUSTS: list[list[Any]] = [[1, F(1, 3), 5], [0, 1, 8], [2, 2, 7], [F(1, 9), 0, -1]]
OUTWARD, UP = [[3, 4, 0], [-8, 6, 0], [-3, -4, 0], [8, -6, 0]], [[0, 0, 1]] * 4


def in_fractions(rows: list[list[Any]]) -> list[list[F]]:
    return [list(map(F, row)) for row in rows]


@pytest.mark.parametrize(
    ("signs", "tilts", "thrusts"),
    [
        ([1, -1, 1, -1], OUTWARD, UP),
        ([-1, 1, -1, 1], OUTWARD, UP),
        ([1, 1, -1, 1], TILTS, THRUSTS),
    ],
)
def test_wrenches_are_enclosed(signs: Any, tilts: Any, thrusts: Any) -> None:
    drags = [3, 6, 1, 2]
    vehicle: dict[str, Any] = {
        "rotor_positions": in_fractions(PLACES),
        "drag_to_thrust": list(map(F, drags)),
    }
    if tilts == OUTWARD:
        vehicle["first_rotor_spin"] = SPIN_WORDS[signs[0]]
    else:
        vehicle["spins"] = [SPIN_WORDS[sign] for sign in signs]
        vehicle["tilt_axes"] = in_fractions(tilts)
        vehicle["thrust_axes"] = in_fractions(thrusts)
    assert check.drag_signs(vehicle) == signs
    with mpmath.workprec(300):
        for k, pair in enumerate(check.wrenches_of(vehicle)):
            place, tilt, thrust = (
                mpmath.matrix([mpmath.mpf(x.numerator) / x.denominator for x in row])
                for row in (PLACES[k], tilts[k], thrusts[k])
            )
            tilt /= mpmath.norm(tilt)
            thrust -= (tilt.T * thrust)[0] * tilt
            thrust /= mpmath.norm(thrust)
            forces = (thrust, crossed(tilt, thrust))
            for wrench, force in zip(pair, forces, strict=True):
                moment = crossed(place, force) + signs[k] * drags[k] * force
                # The mean distance of the rotors from body z is 7.5.
                exact = [*(moment / 7.5), force[2], force[0], force[1]]
                for entry, value in zip(wrench, exact, strict=True):
                    assert entry.low <= value * ONE <= entry.high
                    assert entry.high - entry.low < 50


def test_rotors_on_body_z_and_thrusts_along_tilt_axes_are_refused() -> None:
    vehicle: dict[str, Any] = {
        "first_rotor_spin": "clockwise",
        "rotor_positions": in_fractions(PLACES),
        "drag_to_thrust": [F(1)] * 4,
    }
    vehicle["rotor_positions"][0] = [F(1, 10**20), F(0), F(1)]
    check.wrenches_of(vehicle)
    vehicle["rotor_positions"][0] = [F(0), F(0), F(1)]
    with pytest.raises(ValueError, match="rotor_positions must be off body z"):
        check.wrenches_of(vehicle)
    vehicle["rotor_positions"] = in_fractions(PLACES)
    vehicle["thrust_axes"] = in_fractions([[3, 4, 0], *UP[1:]])
    with pytest.raises(ValueError, match="thrust_axes must be across tilt_axes"):
        check.wrenches_of(vehicle)


def crossed(a: Any, b: Any) -> Any:
    """Return the cross product of matrices of mpmath, which count from the start alone."""
    ahead, aside = (1, 2, 0), (2, 0, 1)
    pairs = zip(ahead, aside, strict=True)
    return mpmath.matrix([a[i] * b[j] - a[j] * b[i] for i, j in pairs])


@pytest.mark.parametrize("vehicle", [PAPER, LEANING])
def test_R_has_the_sign_that_the_package_gives_it(vehicle: Vehicle) -> None:
    """Positive at zero tilt, or with the sign of the first drag where it is zero there, as for PAPER with two spins."""
    alpha = [0.3, -0.2, 0.1, -0.4]
    turned = 0
    for spins in product(("clockwise", "counterclockwise"), repeat=4):
        own = vehicle.replace(spins=list(spins))
        level = level_of_checker(own)
        R = zero_moment_direction(np.array(alpha), own)[2]
        sign = "positive" if R > 0 else "negative"
        parts = check.sign_of_R(still_arc(own, alpha), {"sign": sign})
        assert all(part.low > 0 for part in parts)
        turned += level.sign != check.drag_signs(stated_vehicle(own))[0]
    assert turned > 1


def test_R_is_nearly_zero_up_to_a_share_of_the_size_of_its_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for upright, sign in ((-9, 1), (-10, 1), (-11, -1), (11, 1)):
        lifts = iter([upright, 10**13 - 1, *[0] * 14])

        def hover(_: Any, lifts: Any = lifts) -> list[check.Enclosure]:
            lift = next(lifts)
            return [check.NONE] * 4 + [check.Enclosure(lift, lift)] + [check.NONE] * 2

        monkeypatch.setattr(check, "hover", hover)
        level = level_of_checker(PAPER)
        assert level.sizes[4] == 10**13
        assert level.sign == sign


def test_thrusts_without_moment_are_exact_on_whole_numbers() -> None:
    numbers = np.random.default_rng(3).integers(-9, 10, (20, 4, 6))
    for rows in numbers:
        wrenches = [[check.enclosed(int(x)) for x in row] for row in rows]
        thrusts = np.array([exactly(value) for value in check.hover(wrenches)[:4]])
        assert (thrusts @ rows[:, :3] == 0).all()
        last = round(np.linalg.det(rows[:3, :3]))
        assert thrusts[3] == last  # which tells the sign of all
        forces = [exactly(value) for value in check.hover(wrenches)[4:]]
        assert forces == (thrusts @ rows[:, 3:]).tolist()


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_sizes_of_tables_are_rounded_up(vehicle: Vehicle) -> None:
    level = level_of_checker(vehicle)
    corners = [check.hover([*corner]) for corner in product(*level.wrenches)]
    for table, size in zip(zip(*corners, strict=True), level.sizes, strict=True):
        square = sum(value.size() ** 2 for value in table)
        assert (size - 1) ** 2 <= square < size**2


def test_an_arc_knows_its_ends_and_bents() -> None:
    chance = random.Random(8)
    level, start, end = level_of_checker(VEHICLES[2]), F(1, 4), F(1, 2)
    curves = [[a / 8 for a in random_polynomial(chance, k)] for k in (3, 4, 0, 2)]
    arc = check.Arc(piece_of(level, curves), start, end)
    for rotor, curve in enumerate(curves):
        for wrenches, s in zip(arc.ends, (start, end), strict=True):
            turn = check.turn_by(check.value_at(curve, s))
            pairs = zip(*level.wrenches[rotor], strict=True)
            assert wrenches[rotor] == [check.dot(turn, pair) for pair in pairs]
        around = check.moved(curve, F(3, 8), F(1, 8))
        rate, bend = check.bound(around, 1), check.bound(around, 2)
        assert arc.bents[rotor] == rate * rate + check.HALF * bend


@pytest.mark.parametrize(
    ("curve", "leaves"),
    [
        ([0, 0, 1], 9),  # rate 2, bend 2
        ([0, 1], 2),
        ([0, TINY], 1),  # rounded up to a whole unit
        ([0, 2, 0, F(1, 3)], 17),  # rate 3, bend 2
        ([1], 0),
    ],
)
def test_hovers_are_widened_by_what_they_leave_their_chord_by(
    curve: list[F], leaves: int
) -> None:
    level = level_of_checker(VEHICLES[2])
    level.sizes = [3] * 7
    curves = [[F(a) for a in curve], [F(0)], [F(0)], [F(0)]]
    arc = check.Arc(piece_of(level, curves), F(-1), F(1))
    width = check.Enclosure(-leaves, leaves)
    for hover, wrenches in zip(arc.hovers, arc.ends, strict=True):
        assert hover == [value + width for value in check.hover(wrenches)]


def test_minors_are_less_what_the_gram_matrix_leaves_its_chord_by() -> None:
    arc, other = (still_arc(VEHICLES[2], alpha) for alpha in POINTS[:2])
    arc.ends[1] = other.ends[1]
    weights = [F(7, 400), F(9, 400), F(1, 20), F(1, 40)]
    arc.bents = [check.enclosed(weight) for weight in weights]
    level = level_of(rotors_of(VEHICLES[2]))
    columns = np.concatenate([level.moment, level.force[:, 2:]], axis=1)
    lost = np.einsum("i,iaj,ibj->ab", np.array(weights, float), columns, columns)
    minors = check.least_singular_value(arc, {"at_least": F(1, 5)})
    expected = []
    for matrix in level.matrix(Sines.of(np.array(POINTS[:2]))):
        gram = matrix @ matrix.T - lost - 0.04 * np.eye(4)
        expected += [np.linalg.det(gram[:size, :size]) for size in (1, 2, 3, 4)]
    assert np.allclose([middle(minor) for minor in minors], expected, rtol=1e-12)


def test_thrusts_with_a_sign_of_their_own_at_each_end_are_not_proved() -> None:
    """Between two ends with forces up and down there is a singular matrix."""
    up, down = still_arc(PAPER, POINTS[2]), still_arc(PAPER, POINTS[0])
    for first, last in ((up, down), (down, up)):
        arc = still_arc(PAPER, POINTS[0])
        arc.hovers = [first.hovers[0], last.hovers[0]]
        claims: list[tuple[str, dict[str, Any]]] = [
            ("hover_thrust", {"at_least": F(-9), "at_most": F(9)}),
            ("attitude", {"tilt": F(1, 100)}),
            ("sign_of_R", {"sign": "positive"}),
            ("sign_of_R", {"sign": "negative"}),
        ]
        for name, claim in claims:
            parts = check.PROOFS[name](arc, claim)
            assert not all(part.low > 0 for part in parts), name


# -- Claims


class Truth:
    """What the package says of tilt angles, shape (k, 4): the least and the largest of each quantity."""

    def __init__(self, vehicle: Vehicle, alpha: Any) -> None:
        alpha = np.asarray(alpha, dtype=float)
        force = zero_moment_direction(alpha, vehicle)
        shares = hover_thrust_shares(alpha, vehicle)
        lean = np.hypot(force[:, 0], force[:, 1])
        self.R = force[:, 2]
        self.low, self.high = float(shares.min()), float(shares.max())
        self.singular = float(least_singular_value(alpha, vehicle).min())
        self.margin = float(np.arctan2(np.abs(self.R), lean).min())

    def claims(self, room: Any) -> list[tuple[str, dict[str, Any]]]:
        """Return claims that are true if the room is positive, false if it is negative."""
        low, high = F(self.low) - room, F(self.high) + room
        return [
            ("least_singular_value", {"at_least": F(self.singular) - room}),
            ("hover_thrust", {"at_least": low, "at_most": F(9)}),
            ("hover_thrust", {"at_least": F(-9), "at_most": high}),
            ("attitude", {"tilt": F(self.margin) - room}),
        ]


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_claims_are_decided_at_the_limit_of_what_is_true(vehicle: Vehicle) -> None:
    level = level_of_checker(vehicle)
    for alpha in POINTS:
        truth = Truth(vehicle, [alpha])
        piece = piece_of(level, [[F(angle)] for angle in alpha])
        for room in (TINY, -TINY):
            for name, claim in truth.claims(room):
                assert check.proves(piece, name, claim, F(0), F(1)) == (room > 0), name
        for sign, holds in (("positive", truth.R > 0), ("negative", truth.R < 0)):
            assert check.proves(piece, "sign_of_R", {"sign": sign}, F(0), F(1)) == holds
        assert not check.proves(piece, "attitude", {"tilt": F("1.6")}, F(0), F(1))


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_no_claim_of_a_curve_is_proved_that_samples_contradict(
    vehicle: Vehicle,
) -> None:
    chance = random.Random(6)
    level, proved = level_of_checker(vehicle), 0
    for _ in range(8):
        curves = [[a / 16 for a in random_polynomial(chance, 2)] for _ in range(2)] * 2
        size = F(1, chance.choice((4, 16)))
        s = np.linspace(0, float(size), 60)
        alpha = [np.polyval([float(a) for a in curve[::-1]], s) for curve in curves]
        truth = Truth(vehicle, np.array(alpha).T)
        piece = piece_of(level, curves)
        for name, claim in truth.claims(F(-1, 50)):
            assert not check.proves(piece, name, claim, F(0), size), name
        for name, claim in truth.claims(F(1, 20)):
            proved += check.proves(piece, name, claim, F(0), size)
        for sign, side in (("positive", 1), ("negative", -1)):
            if check.proves(piece, "sign_of_R", {"sign": sign}, F(0), size):
                assert (side * truth.R > 0).all()
    assert proved > 16


def test_what_may_be_zero_is_not_proved_to_be_positive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for low in (-1, 0, 1):
        parts = [check.Enclosure(low, 9)]
        monkeypatch.setitem(check.PROOFS, "attitude", lambda *_, parts=parts: parts)
        piece = piece_of(level_of_checker(PAPER), [[F(0)]] * 4)
        assert check.proves(piece, "attitude", {}, F(0), F(1)) == (low > 0)


def test_angles_and_derivatives_are_within_bounds_that_they_reach() -> None:
    """Joint k turns by k·s³ within 3 s; of each derivative both ends of half the piece are the extremes."""
    curves = [[F(0), F(0), F(0), F(k)] for k in (1, 2, 3, 4)]
    piece = piece_of(None, curves, duration=3)
    for name, low, high in (
        ("tilt", F(1, 8), F(1)),
        ("rate", F(1, 4), F(1)),
        ("acceleration", F(1, 3), F(2, 3)),
        ("jerk", F(2, 9), F(2, 9)),
    ):
        for joint in (None, 0, 1, 2, 3):
            for less, more in ((0, 0), (F(1, 10**30), 0), (0, F(1, 10**30))):
                least, most = ([k * end for k in (1, 2, 3, 4)] for end in (low, high))
                if joint is not None:
                    least[joint] += less
                    most[joint] -= more
                holds = joint is None or not (less or more)
                claim = {"at_least": least, "at_most": most}
                assert check.proves(piece, name, claim, F(1, 2), F(1)) == holds


def test_jumps_are_the_largest_of_four_joints() -> None:
    still = piece_of(None, [[F(0)], [F(0)]])
    for joint in range(4):
        curves = [[F(0)]] * 4
        curves[joint] = [F(1), F(3), F(5)]
        piece = piece_of(None, curves)
        assert [check.jump(still, piece, order) for order in range(3)] == [1, 3, 10]
        assert [check.jump(piece, still, order) for order in range(3)] == [9, 13, 10]
        assert check.jump(piece, piece, 0) == 8


# -- Documents


def made(vehicle: Vehicle = PAPER, smooth: bool = True) -> dict[str, Any]:
    """Return a certificate of a loop of three corners, without the package's own maker: claims with some room."""
    corners = [(F("0.4"), F("-0.7")), (F("0.9"), F("-0.7")), (F("0.9"), F(-1))]
    pieces, samples = [], []
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        rise = (0, 0, 10, -15, 6) if smooth else (1,)
        curves = []
        for a, b in zip(start, end, strict=True):
            curves.append([str(a), *(str((b - a) * share) for share in rise)])
        pieces.append({"alpha": curves, "duration": "1"})
        ends = np.array([start * 2, end * 2], dtype=float)
        samples.append(ends[0] + np.linspace(0, 1, 40)[:, None] * (ends[1] - ends[0]))
    truth = Truth(vehicle, np.concatenate(samples))
    claims: dict[str, Any] = {
        "joints": {"rate_jump": "0" if smooth else "1", "acceleration_jump": "0"},
        "least_singular_value": {"at_least": f"{truth.singular - 0.02:.6f}"},
        "sign_of_R": {"sign": "positive" if truth.R[0] > 0 else "negative"},
        "hover_thrust": {
            "at_least": f"{truth.low - 0.02:.6f}",
            "at_most": f"{truth.high + 0.02:.6f}",
        },
        "tilt": {"at_least": ["0.4", "-1"] * 2, "at_most": ["0.9", "-0.7"] * 2},
        "rate": {"at_least": ["-1", "-0.6"] * 2, "at_most": ["1", "0.6"] * 2},
    }
    for name, claim in claims.items():
        count = 32 if name in ("hover_thrust", "rate") else 16
        if name != "joints":
            claim["cover"] = [[f"{k}/{count}" for k in range(count + 1)]] * 3
    return {
        "format": "gaitgraph certificate 3",
        "made_by": "hand",
        "deviation": "0.000001",
        "path": "closed",
        "vehicle": json.loads(json.dumps(stated_vehicle(vehicle), default=str)),
        "pieces": pieces,
        "claims": claims,
    }


def checked(document: dict[str, Any]) -> dict[str, Any]:
    return check.check(json.dumps(document))


def only(document: dict[str, Any], *names: str) -> dict[str, Any]:
    """Return a document with the claim of its joints and some others."""
    claims = {name: document["claims"][name] for name in ("joints", *names)}
    return {**document, "claims": claims}


def with_claim(
    document: dict[str, Any], name: str, to: Any, claim: str = "at_least"
) -> Any:
    return changed(document, "claims", name, claim, to=to)


@pytest.mark.parametrize(
    ("vehicle", "smooth"), [*zip(VEHICLES, (True, False, True, True), strict=True)]
)
def test_true_claims_are_proved_and_false_ones_are_not(
    vehicle: Vehicle, smooth: bool
) -> None:
    document = made(vehicle, smooth)
    answer = checked(document)
    assert answer["proved"], answer["lines"]
    for name, bound, room in (
        ("hover_thrust", "at_least", F("0.021")),
        ("hover_thrust", "at_most", F("-0.021")),
        ("least_singular_value", "at_least", F("0.021")),
    ):
        false = str(F(document["claims"][name][bound]) + room)
        answer = checked(with_claim(only(document, name), name, false, bound))
        assert not answer["proved"]
        assert answer["claims"]["joints"] == ""
        assert answer["claims"][name].startswith("on piece ")


def test_the_answer_says_what_is_proved_and_where_something_is_not() -> None:
    document = made()
    answer = checked(document)
    assert (answer["proved"], answer["flyable"], len(answer["lines"])) == (
        True,
        True,
        8,
    )
    assert answer["vehicle"] == document["vehicle"]
    assert answer["lines"][:3] == [
        f"vehicle {json.dumps(document['vehicle'])}",
        "path closed: it ends where it begins, and may be repeated",
        'proved: joints {"rate_jump": "0", "acceleration_jump": "0"}',
    ]
    assert answer["values"]["tilt"].keys() == {"at_least", "at_most"}
    wrong = {"positive": "negative", "negative": "positive"}
    sign = wrong[document["claims"]["sign_of_R"]["sign"]]
    answer = checked(with_claim(document, "sign_of_R", sign, "sign"))
    assert (answer["proved"], answer["flyable"], len(answer["lines"])) == (
        False,
        False,
        8,
    )
    line = f'NOT proved: sign_of_R {{"sign": "{sign}"}} on piece 0 from 0 to 1/16'
    assert line in answer["lines"]


def test_flyable_is_what_claims_enough() -> None:
    document = only(made(), "least_singular_value", "hover_thrust")
    for name, value, flyable in (
        ("least_singular_value", "0.05", True),
        ("least_singular_value", "0.0499", False),
        ("hover_thrust", "0", True),
        ("hover_thrust", "-0.0001", False),
    ):
        answer = checked(with_claim(document, name, value))
        assert (answer["proved"], answer["flyable"]) == (True, flyable)
        lacking = f"not proved flyable: {name} at least {value}, below "
        assert answer["lines"][-1].startswith(lacking) == (not flyable)
    line = checked(only(document, "least_singular_value"))["lines"][-1]
    assert line == "not proved flyable: no claim of hover_thrust"


def test_jumps_at_joints_are_compared_with_what_is_stated() -> None:
    document = only(made(smooth=False))
    for jump, value, place in (
        ("rate_jump", "1", ""),
        ("rate_jump", "0.9999999", "at the start of piece 0"),
        ("acceleration_jump", "0", ""),
    ):
        answer = checked(with_claim(document, "joints", value, jump))
        assert answer["claims"]["joints"] == place
    for piece, start in ((2, 0), (1, 1)):
        apart = changed(document, "pieces", piece, "alpha", 0, 0, to="0.9000000001")
        assert checked(apart)["claims"]["joints"] == f"at the start of piece {start}"


def opened(document: dict[str, Any]) -> dict[str, Any]:
    """Return the first two pieces of a document, as a path that is run once."""
    claims = {"joints": {"rate_jump": "99", "acceleration_jump": "0"}}
    pieces = document["pieces"][:2]
    return {**document, "pieces": pieces, "claims": claims, "path": "open"}


def joints_of(document: dict[str, Any]) -> str:
    return str(checked(document)["claims"]["joints"])


def test_an_open_path_need_not_end_where_it_begins() -> None:
    document = opened(made())
    answer = checked(document)
    assert (answer["proved"], answer["path"]) == (True, "open")
    assert answer["lines"][1] == "path open: it is run once, at rest at both ends"
    assert joints_of({**document, "path": "closed"}) == "at the start of piece 0"
    apart = changed(document, "pieces", 1, "alpha", 0, 0, to="0.9000000001")
    assert joints_of(apart) == "at the start of piece 1"
    assert joints_of({**made(), "path": "open"}) == ""


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize(("piece", "place"), [(0, 0), (1, 2)])
def test_an_open_path_rests_at_both_ends(joint: int, piece: int, place: int) -> None:
    """No claim of joints allows a rate at an end, and that of accelerations holds there."""
    document = opened(made())
    for power, jump in ((1, "99"), (2, "0")):
        # A little of x (1 - x)⁴, which moves at x = 0, or of x² (1 - x)³, which turns there.
        bump = [F(0)] * power + [F(1, 10**30)]
        for _ in range(5 - power):
            bump = [a - b for a, b in zip([*bump, F(0)], [F(0), *bump], strict=True)]
        if piece == 1:
            bump = check.moved(bump, F(1), F(-1))
        curve = [F(a) for a in document["pieces"][piece]["alpha"][joint]]
        curve += [F(0)] * (6 - len(curve))
        sums = [str(a + b) for a, b in zip(curve, bump, strict=True)]
        other = changed(document, "pieces", piece, "alpha", joint, to=sums)
        stated = with_claim(other, "joints", jump, "acceleration_jump")
        assert joints_of(stated) == f"at the start of piece {place}"
        free = with_claim(other, "joints", "99", "acceleration_jump")
        assert (joints_of(free) == "") == (power == 2)


def test_a_gait_in_motion_where_it_begins_is_no_open_path() -> None:
    moving = made(smooth=False)
    assert joints_of(moving) == ""
    assert joints_of({**moving, "path": "open"}) == "at the start of piece 0"
    document = opened(made())
    for piece, place in ((0, 0), (1, 2)):
        other = changed(document, "pieces", piece, to=moving["pieces"][piece])
        other = with_claim(other, "joints", "99", "acceleration_jump")
        assert joints_of(other) == f"at the start of piece {place}"


def test_each_interval_of_a_cover_is_proved_by_itself() -> None:
    document = only(made(), "rate")
    cover = document["claims"]["rate"]["cover"]
    for coarse, piece in (([["0", "1"]] * 3, 0), ([*cover[:2], ["0", "1"]], 2)):
        answer = checked(with_claim(document, "rate", coarse, "cover"))
        assert answer["claims"]["rate"] == f"on piece {piece} from 0 to 1"


MALFORMED: list[tuple[str, Any]] = [
    ("format", "gaitgraph certificate 2"),
    ("path", "opened"),
    ("made_by", 1),
    ("deviation", ""),
    ("deviation", "1/01"),
    ("deviation", "1e3"),
    ("deviation", "٣"),
    ("deviation", "1\n"),
    ("deviation", True),
    ("law", []),
    ("vehicle", None),
    ("vehicle", ["rotor_positions"]),
    ("vehicle more", "1"),
    ("vehicle drag_to_thrust 1", "0.00"),
    ("vehicle drag_to_thrust", ["1"] * 5),
    ("vehicle rotor_positions", [["1"] * 3] * 3),
    ("vehicle rotor_positions 0", ["0", "1"]),
    ("vehicle rotor_positions 0", ["1"] * 4),
    ("vehicle first_rotor_spin", "left"),
    ("pieces", []),
    ("pieces 0 alpha", [["0"]]),
    ("pieces 0 alpha", [["0"]] * 3),
    ("pieces 0 alpha", [["0"]] * 6),
    ("pieces 0 alpha 0", []),
    ("pieces 0 duration", "-1"),
    ("claims", {}),
    ("claims more", {}),
    ("claims joints more", "1"),
    ("claims least_singular_value at_least", "-0.4"),
    ("claims rate at_most", ["1"] * 3),
    ("claims rate at_least", ["1"] * 5),
    ("claims tilt cover", [["0", "1"]] * 2),
    ("claims tilt cover", [["0", "1"]] * 4),
    ("claims tilt cover", []),
    ("claims tilt cover 2", ["1"]),
    ("claims tilt cover 2", ["0", "1/2"]),
    ("claims tilt cover 1", ["1/2", "1"]),
    ("claims tilt cover 2", ["0", "2/3", "1/3", "1"]),
    ("claims tilt cover 2", ["0", "1/2", "1/2", "1"]),
    ("pieces 0 alpha 0", ["0.4", "0.5"] + ["0"] * 63),
]


def at_path(document: dict[str, Any], path: str, value: Any) -> str:
    keys = [int(key) if key.isdigit() else key for key in path.split()]
    return json.dumps(changed(document, *keys, to=value))


@pytest.mark.parametrize(("path", "value"), MALFORMED)
def test_what_is_no_certificate_is_refused_by_its_place(path: str, value: Any) -> None:
    with pytest.raises(ValueError, match=r" must .*, got ") as caught:
        check.read(at_path(made(), path, value))
    name = str(caught.value).split()[0]
    assert name in {*path.split(), "the"}
    assert len(str(caught.value).rpartition(", got ")[2]) <= 60


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("made_by", "a\nb" * 1000),
        ("made_by", ""),
        ("deviation", "9" * 400),
        ("deviation", "-0." + "9" * 600),
        ("deviation", "1/" + "9" * 600),
        ("pieces 0 alpha 0", ["0.4", "0.5"] + ["0"] * 62),
        ("pieces 0 alpha", [["0.4", "1"]] * 4),
        ("vehicle rotor_positions 0 2", "-0"),
    ],
)
def test_what_is_a_certificate_at_the_limits_of_its_form(path: str, value: Any) -> None:
    check.read(at_path(made(smooth=False), path, value))


def test_texts_that_are_no_document_are_refused() -> None:
    text = json.dumps(made())
    twice = text.replace('"made_by": ', '"made_by": "", "made_by": ', 1)
    for other in ("", "[]", "null", '"a"', text[:-9], "[" * 10**5, twice, "1" * 5000):
        with pytest.raises((ValueError, RecursionError)):
            check.check(other)


# -- Tables


def rows_of(
    document: dict[str, Any], times: list[F], start: F = ZERO
) -> list[check.Row]:
    """Return rows on the curve of a document of three pieces of a second each."""
    rows = []
    for time in times:
        k = min(int(time), 2)
        curves = [[F(a) for a in curve] for curve in document["pieces"][k]["alpha"]]
        alpha = [check.value_at(curve, time - k) for curve in curves] * 2
        rows.append(check.Row(start + time, alpha, [F(0)] * 4))
    return rows


def edited(rows: list[check.Row], number: int, **changes: Any) -> list[check.Row]:
    return [
        row._replace(**changes) if k == number else row for k, row in enumerate(rows)
    ]


QUARTERS = [F(k, 4) for k in range(13)]


@pytest.mark.parametrize("start", [F(0), F(7, 10), F(-3)])
def test_rows_are_held_against_the_curve(start: F) -> None:
    document = made()
    text, rows = json.dumps(document), rows_of(document, QUARTERS, start)
    off, between = check.held_against(text, rows)
    assert off == ""
    largest = F(0)
    middles = rows_of(document, [F(2 * k + 1, 8) for k in range(12)])
    for exact, before, row in zip(middles, rows, rows[1:], strict=False):
        for angle, a, b in zip(exact.angles, before.angles, row.angles, strict=True):
            largest = max(largest, abs(angle - (a + b) / 2))
    assert between == float(largest)

    limit = F(document["deviation"])
    for joint, size in ((0, limit), (3, -limit), (2, limit * 2)):
        slacks = [F(0)] * 4
        slacks[joint] = abs(size) - limit
        for share, holds in ((1, True), (1 + TINY, False)):
            angles = [*rows[5].angles]
            angles[joint] += size * share
            other = edited(rows, 5, angles=angles, slacks=slacks)
            off, _ = check.held_against(text, other)
            assert (off == "") == holds
            place = f"row 6, t = {float(rows[5].t):.9g} s: alpha{joint + 1} is "
            assert holds or off.startswith(place)
            assert holds or off.endswith(f"allowed is {float(abs(size)):.3g}")
    for k in (1, 4):
        off, _ = check.held_against(text, edited(rows, k, t=rows[k - 1].t))
        place = f"row {k + 1}, t = {float(rows[k - 1].t):.9g} s"
        assert off == f"{place}, is not after the row before it"


def test_rows_last_as_long_as_the_curve() -> None:
    document = made()
    text, rows = json.dumps(document), rows_of(document, QUARTERS)
    for late, off in (
        (F(5, 10**9), ""),
        (F(6, 10**9), "the rows last 3.00000001 s, the curve 3 s"),
    ):
        last = rows[-1]._replace(t=rows[-1].t + late)
        assert check.held_against(text, [*rows, last])[0] == off
    for some, seconds in ((rows[:-1], "2.75"), (rows[:1], "0")):
        off, _ = check.held_against(text, some)
        assert off == f"the rows last {seconds} s, the curve 3 s"
    slow = [row._replace(t=3 * row.t) for row in rows]
    for piece in document["pieces"]:
        piece["duration"] = "3"
    assert check.held_against(json.dumps(document), slow)[0] == ""
    del document["claims"]["rate"]
    with pytest.raises(ValueError, match="claims must have a rate to compare"):
        check.held_against(json.dumps(document), rows)


def test_rounded_times_are_taken_for_even_ones_by_half_a_unit_alone() -> None:
    document = made()
    text = json.dumps(document)
    thirds = rows_of(document, [F(k, 3) for k in range(10)])
    rounded = [row._replace(t=round(row.t, 3)) for row in thirds]
    assert check.held_against(text, rounded, F(1, 2000))[0] == ""
    for half_unit in (F(0), F(1, 3001)):
        off, _ = check.held_against(text, rounded, half_unit)
        assert off.startswith("row 2, t = 0.333 s: alpha1")
    # Units above a fiftieth of a step leave the times as they are.
    coarse = [row._replace(t=round(row.t, 1)) for row in rows_of(document, QUARTERS)]
    assert check.held_against(text, coarse, F(1, 20))[0].startswith("row 2, t = 0.2 s")


def rows_at(*times: Any) -> list[check.Row]:
    return [check.Row(F(t), [], []) for t in times]


UNIT = F(1, 400)
HALF = UNIT / 2


@pytest.mark.parametrize("start", [F(0), F(133, 400), F(-133, 400)])
def test_times_may_be_even_ones_that_were_rounded(start: F) -> None:
    exact = start + F(49, 40000) * (
        start != 0
    )  # a first time that is not 0 is rounded too
    rows = rows_at(*(round((exact + F(k, 7)) / UNIT) * UNIT for k in range(8)))
    even = rows_at(*(rows[0].t + F(k, 7) for k in range(8)))
    assert check.even_or_own(rows, HALF, F(1)) == even
    assert check.even_or_own(rows, HALF / 2, F(1)) == rows
    assert check.even_or_own(rows, HALF, F(2)) == rows
    late = edited(rows, 3, t=rows[3].t + UNIT)
    assert check.even_or_own(late, HALF, F(1)) == late


@pytest.mark.parametrize(
    ("start", "share", "less"),
    [(F(0), F("1.000001"), F(1, 10**20)), (F(1), F("1.999"), TINY)],
)
def test_how_far_rounding_may_move_times(start: F, share: F, less: F) -> None:
    """A time half a unit late: even to within that; with a first time that is rounded, to within two halves."""
    rows = rows_at(start, start + F(1, 2) + HALF, start + 1)
    least = HALF / share
    assert check.even_or_own(rows, least, F(1))[1].t == start + F(1, 2)
    assert check.even_or_own(rows, least - less, F(1)) == rows


def test_few_rows_are_even_if_they_fit() -> None:
    rows = rows_at(0, "0.333")
    assert check.even_or_own(rows, F(1, 300), F(1, 3)) == rows_at(0, "1/3")
    assert check.even_or_own(rows, F(1, 299), F(1, 3)) == rows
    assert check.even_or_own(rows_at(0), UNIT, F(1)) == rows_at(0)


NAMES = "t,alpha1,alpha2,alpha3,alpha4"


def test_rows_of_a_csv_file_are_exact(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    text = f"\ufeff{NAMES},x\n0,0.1,-0.2,3e-1,0.4,a\n0.25,1,2,3,4,b\n"
    path.write_text(text, encoding="utf-8")
    rows, half_unit = check.rows_of_csv(path)
    assert rows[0] == (F(0), [F(1, 10), F(-1, 5), F(3, 10), F(2, 5)], [F(0)] * 4)
    assert rows[1].angles == [F(1), F(2), F(3), F(4)]
    assert (len(rows), half_unit) == (2, F(1, 200))
    for time, digits in (("1", 0), ("0.5", 1), ("1/3", 60), ("1e-59", 59)):
        path.write_text(f"{NAMES}\n0,0,0,0,0\n{time},0,0,0,0")
        assert check.rows_of_csv(path)[1] == F(1, 2 * 10**digits)


@pytest.mark.parametrize(
    "text",
    ["", "t,alpha1\n0,1\n", NAMES]
    + [
        f"{NAMES}\n{row}\n"
        for row in (
            "0,a,0,0,0",
            "0,0,0,0",
            "0,1/0,0,0,0",
            '0,"0"0,0,0,0',
            "0,1E+9999,0,0,0",
        )
    ],
)
def test_what_is_no_table_of_times_and_angles_is_refused(
    text: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"^a\.csv must (have rows|hold numbers in)"):
        check.rows_of_csv(path)


# -- The program


def run_alone(*arguments: Any) -> tuple[int, str, str]:
    command = [sys.executable, "-I", str(CHECKER), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def test_the_program_answers_by_its_exit_code_and_a_line_for_each_claim(
    tmp_path: Path,
) -> None:
    document = made()
    path, table = tmp_path / "gait.cert.json", tmp_path / "gait.csv"
    path.write_text("\ufeff" + json.dumps(document), encoding="utf-8")
    rows = rows_of(document, [F(k, 8) for k in range(25)])
    lines = [",".join(str(float(x)) for x in (row.t, *row.angles)) for row in rows]
    table.write_text("\n".join([NAMES, *lines]))
    code, out, err = run_alone(path)
    assert (code, err, out.count("\nproved: ")) == (0, "", 6)
    assert out.endswith("\nno table was compared\n")
    code, out, err = run_alone(path, table)
    assert (code, err) == (0, "")
    assert "\neach row is on the curve to 1e-06 rad, lines between rows to 0.0" in out

    table.write_text("\n".join([NAMES, *lines[:4], "0.5,0.7,0,0,0", *lines[5:]]))
    code, out, err = run_alone(path, table)
    assert (code, err) == (1, "")
    assert "\nNOT on the curve: row 5, t = 0.5 s: alpha1 is 0.05 rad off" in out
    assert "each row" not in out
    wrong = with_claim(only(document, "tilt"), "tilt", ["0"] * 4, "at_most")
    path.write_text(json.dumps(wrong))
    assert run_alone(path)[0] == 1
    huge, far = tmp_path / "huge.json", tmp_path / "far.csv"
    huge.write_text(at_path(document, "pieces 0 alpha 0", ["9" * 400]))
    far.write_text(f"{NAMES}\n0,1e400,0,0,0\n")
    refused: list[Any] = [(), (path, table, path), (tmp_path / "none.json",)]
    refused += [(huge,), (path, far)]  # with numbers beyond floats
    for arguments in refused:
        code, out, err = run_alone(*arguments)
        assert (code, out, len(err.splitlines())) == (2, "", 1)
        assert err.startswith("check.py: ")

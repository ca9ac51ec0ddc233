"""Check a gait's certificate with the standard library, and a CSV table against its curve.

docs/theory.md, 20, says why each step is right. The exit code is 0 if all is proved, 1 if
not, 2 if a file is no certificate or no table.
"""

from __future__ import annotations

import csv
import json
import re
import sys
from bisect import bisect_right
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate, pairwise, product
from math import comb, isqrt, perm
from pathlib import Path
from typing import Any, NamedTuple

ONE, ZERO = 1 << 96, Fraction(0)  # enclosures are integers times 1 / ONE
# The form of a document: objects by their names, texts by a pattern, lists by what is in
# them and by how many there may be: at least one if nothing is stated.
NUMBER = "an exact number in a text"  # a decimal or a fraction
POSITIVE = "a positive exact number in a text"
TEXT = "a text"
DIGITS = r"[0-9]+(\.[0-9]+|/[1-9][0-9]*)?"
PATTERNS = {
    NUMBER: f"-?{DIGITS}",
    POSITIVE: f"(?=[0-9.]*[1-9]){DIGITS}",
    TEXT: "(?s:.*)",
}
COVER = {"cover": [[NUMBER]]}
RANGES = {"at_least": [NUMBER, 4], "at_most": [NUMBER, 4], **COVER}
ORDERS = {"tilt": 0, "rate": 1, "acceleration": 2, "jerk": 3}  # derivatives by time
SIGNS = {"positive": 1, "negative": -1}
JUMPS = ("rate_jump", "acceleration_jump")
CLAIMS: dict[str, Any] = {
    **dict.fromkeys(ORDERS, RANGES),
    "least_singular_value": {"at_least": POSITIVE, **COVER},
    "sign_of_R": {"sign": "|".join(SIGNS), **COVER},
    "hover_thrust": {"at_least": NUMBER, "at_most": NUMBER, **COVER},
    "attitude": {"tilt": NUMBER, **COVER},
    "joints": dict.fromkeys(JUMPS, NUMBER),
}
SPINS = {"clockwise": 1, "counterclockwise": -1}  # and the signs of their drags
SPIN = "|".join(SPINS)
VECTORS = [[NUMBER, 3], 4]
ROTORS = {"rotor_positions": VECTORS, "drag_to_thrust": [POSITIVE, 4]}
AXES = {"spins": [SPIN, 4], "tilt_axes": VECTORS, "thrust_axes": VECTORS}
VEHICLES = (
    {"name": TEXT, "first_rotor_spin": SPIN, **ROTORS},
    {"name": TEXT, **ROTORS, **AXES},
)
FORM = {
    "format": "gaitgraph certificate 3",
    "made_by": TEXT,
    "deviation": NUMBER,
    "path": "closed|open",
    "vehicle": VEHICLES,
    "pieces": [{"alpha": [[NUMBER], 2, 4], "duration": POSITIVE}],
    "claims": CLAIMS,
}
PATHS = {
    "closed": "path closed: it ends where it begins, and may be repeated",
    "open": "path open: it is run once, at rest at both ends",
}
FLYABLE = {"least_singular_value": Fraction("0.05"), "hover_thrust": ZERO}
"""What the claims of a flyable gait are at least."""


class Enclosure(NamedTuple):
    """What a number is between, as integers times 1 / ONE."""

    low: int
    high: int

    def __add__(self, other: Enclosure) -> Enclosure:  # type: ignore[override]
        return Enclosure(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Enclosure) -> Enclosure:
        return Enclosure(self.low - other.high, self.high - other.low)

    def __mul__(self, other: Enclosure) -> Enclosure:  # type: ignore[override]
        a, b = self
        c, d = other
        ends = (a * c, a * d, b * c, b * d)
        return Enclosure(min(ends) >> 96, -(-max(ends) >> 96))

    def inverse(self) -> Enclosure:
        """Return the reciprocal of a positive number."""
        return Enclosure(ONE**2 // self.high, -(-(ONE**2) // self.low))

    def size(self) -> int:
        """Return what the number is at most in size."""
        return max(-self.low, self.high)


Vector = list[Enclosure]
Polynomial = list[Fraction]  # the lowest power first
NONE = Enclosure(0, 0)


def enclosed(number: Fraction | int) -> Enclosure:
    """Return the least enclosure of an exact number."""
    top = number.numerator * ONE
    return Enclosure(top // number.denominator, -(-top // number.denominator))


HALF = enclosed(Fraction(1, 2))


def root(square: Fraction) -> Enclosure:
    """Return the square root of an exact number that is not negative."""
    below = isqrt(square * ONE**2 // 1)
    return Enclosure(below, below + 1)


@lru_cache  # neighbours share an end
def turn_by(angle: Fraction) -> Vector:
    """Return the cosine and the sine of an angle, by Taylor's formula."""
    if abs(angle) > 4:
        raise ValueError(f"angles must be at most 4 rad in size, got {float(angle):g}")
    cosine = sine = NONE
    term = enclosed(1)
    power = 0
    while term.size() > 1:
        cosine += term
        term *= enclosed(angle / (power + 1))
        sine += term
        term *= enclosed(-angle / (power + 2))
        power += 2
    # What is left is at most the first term that is left out.
    rest = Enclosure(-term.size(), term.size())
    return [cosine + rest, sine + rest]


def dot(some: Any, others: Any) -> Enclosure:
    """Return the sum of products."""
    total = NONE
    for one, other in zip(some, others, strict=True):
        total += one * other
    return total


def determinant(rows: list[Vector]) -> Enclosure:
    """Return the determinant of a matrix, expanded by its first row."""
    if len(rows) == 1:
        return rows[0][0]
    total = NONE
    for column, entry in enumerate(rows[0]):
        minor = [row[:column] + row[column + 1 :] for row in rows[1:]]
        part = entry * determinant(minor)
        total = total - part if column % 2 else total + part
    return total


def cross(a: Any, b: Any) -> list[Any]:
    """Return the cross product of vectors."""
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def unit(vector: list[Fraction]) -> Vector:
    """Return an exact vector divided by its length."""
    x, y, z = vector
    square = x * x + y * y + z * z
    if square == 0:
        raise ValueError("thrust_axes must be across tilt_axes, got one along its own")
    parts = []
    for part in vector:
        sign = 1 if part > 0 else -1
        parts.append(enclosed(sign) * root(part * part / square))
    return parts


def drag_signs(vehicle: dict[str, Any]) -> list[int]:
    """Return the signs of the drags; neighbours turn in opposite senses by default."""
    if "spins" in vehicle:
        return [SPINS[spin] for spin in vehicle["spins"]]
    first = SPINS[vehicle["first_rotor_spin"]]
    return [first, -first, first, -first]


def wrenches_of(vehicle: dict[str, Any]) -> list[list[Vector]]:
    """Return for unit thrust of each rotor its wrenches at α = 0 and a quarter turn.

    A wrench has the moments about body x, y, z and the force along z, x, y. Lengths are in
    units of the mean distance of the rotors from body z. By default rotors tilt about the
    horizontal lines towards them, and thrust up at α = 0.
    """
    places = vehicle["rotor_positions"]
    mean = NONE
    tilt_axes = []
    for x, y, _ in places:
        quarter = root((x * x + y * y) / 16)  # of its distance
        if quarter.low == 0:
            raise ValueError("rotor_positions must be off body z, got one on it")
        mean += quarter
        tilt_axes.append([x, y, ZERO])
    scale = mean.inverse()
    tilt_axes = vehicle.get("tilt_axes", tilt_axes)
    thrust_axes = vehicle.get("thrust_axes", [[ZERO, ZERO, Fraction(1)]] * 4)
    signs = drag_signs(vehicle)
    wrenches = []
    for rotor, tilt_axis in enumerate(tilt_axes):
        arm = [enclosed(part) * scale for part in places[rotor]]
        drag = enclosed(signs[rotor] * vehicle["drag_to_thrust"][rotor]) * scale
        turned = cross(tilt_axis, thrust_axes[rotor])
        upright = cross(turned, tilt_axis)  # the thrust axis across the tilt axis
        pair = []
        for direction in (upright, turned):
            force = unit(direction)
            moment = cross(arm, force)
            for axis in range(3):
                moment[axis] += drag * force[axis]
            x, y, z = force
            pair.append([*moment, z, x, y])
        wrenches.append(pair)
    return wrenches


def hover(wrenches: list[Vector]) -> Vector:
    """Return the four thrusts that make no moment, then their force along z, x and y."""
    thrusts = []
    for rotor in range(4):
        others = [wrench[:3] for wrench in wrenches]
        del others[rotor]
        thrusts.append(enclosed((-1) ** (rotor + 1)) * determinant(others))
    forces = list(zip(*wrenches, strict=True))[3:]
    return thrusts + [dot(thrusts, force) for force in forces]


def gram(wrenches: list[Vector]) -> list[Vector]:
    """Return M M', where the first four numbers of each wrench are a column of M."""
    rows = list(zip(*wrenches, strict=True))[:4]
    return [[dot(row, other) for other in rows] for row in rows]


class Level:
    """Level flight of a vehicle: the numbers from which every claim follows.

    Each of the seven values of `hover` is linear in (cos α, sin α) of each rotor, and `sizes`
    are roots of sums of squares of a table: the values where each α is 0 or a quarter turn.
    `squares` has what the two wrenches of each rotor add to M M'. R has the sign of the
    vertical force times `sign`: that of rotor 1's drag, unless R were then negative where
    each α is 0.
    """

    def __init__(self, vehicle: dict[str, Any]) -> None:
        self.wrenches = wrenches_of(vehicle)
        self.squares = [gram(pair) for pair in self.wrenches]
        table = [hover(list(corner)) for corner in product(*self.wrenches)]
        self.sizes = []
        for values in zip(*table, strict=True):
            squares = [value.size() ** 2 for value in values]
            self.sizes.append(isqrt(sum(squares)) + 1)
        self.sign = drag_signs(vehicle)[0]
        lift = enclosed(self.sign) * table[0][4]
        if lift.high * 10**12 < -self.sizes[4]:
            self.sign = -self.sign


def moved(curve: Polynomial, origin: Fraction, unit: Fraction) -> Polynomial:
    """Return a polynomial as one of x, where its argument is origin + unit * x."""
    out = list(curve)
    for first in range(len(out)):  # Taylor's coefficients about the origin
        for k in reversed(range(first, len(out) - 1)):
            out[k] += origin * out[k + 1]
    return [a * unit**k for k, a in enumerate(out)]


def value_at(polynomial: Polynomial, at: Fraction) -> Fraction:
    """Return the value of a polynomial."""
    value = ZERO
    for a in reversed(polynomial):
        value = value * at + a
    return value


def bound(curve: Polynomial, order: int) -> Enclosure:
    """Return what a derivative of a polynomial of u in [-1, 1] is at most in size."""
    size = sum(perm(k, order) * enclosed(a).size() for k, a in enumerate(curve))
    return Enclosure(size, size)


class Piece:
    """A piece of the curve: `motion` has its four angles and their derivatives by time.

    They are polynomials of the share of the duration that has passed. Opposite angles are
    equal if two are stated.
    """

    def __init__(self, stated: dict[str, Any], level: Level) -> None:
        self.level = level
        self.duration = stated["duration"]
        self.motion = [(stated["alpha"] * 2)[:4]]
        for _ in range(3):
            curves = []
            for curve in self.motion[-1]:
                terms = [k * a / self.duration for k, a in enumerate(curve)]
                curves.append(terms[1:] or [ZERO])
            self.motion.append(curves)

    def at(self, share: Fraction, order: int = 0) -> list[Fraction]:
        """Return the angles or a derivative at a share of the duration."""
        return [value_at(curve, share) for curve in self.motion[order]]


class Arc:
    """An interval of a piece: what is known at both ends, and of what is between them.

    `ends` has the wrenches at both, and `hovers` their values, widened by what they leave
    the line between them: no second derivative by angles exceeds the size of a table.
    M M' leaves it by at most the squares of the rotors times `bents`.
    """

    def __init__(self, piece: Piece, start: Fraction, end: Fraction) -> None:
        self.level = level = piece.level
        self.bents = []
        rates = bends = NONE
        for curve in piece.motion[0]:
            around = moved(curve, (start + end) / 2, (end - start) / 2)
            rate = bound(around, 1)
            bend = bound(around, 2)
            self.bents.append(rate * rate + HALF * bend)
            rates += rate
            bends += bend
        bent = HALF * (rates * rates + bends)
        self.ends = []
        self.hovers = []
        for s in (start, end):
            wrenches = []
            for angle, pair in zip(piece.at(s), level.wrenches, strict=True):
                turn = turn_by(angle)
                wrenches.append([dot(turn, parts) for parts in zip(*pair, strict=True)])
            values = []
            for value, size in zip(hover(wrenches), level.sizes, strict=True):
                most = -(-size * bent.high // ONE)
                values.append(value + Enclosure(-most, most))
            self.ends.append(wrenches)
            self.hovers.append(values)


arc_on = lru_cache(Arc)  # claims share intervals


def alike(parts: Vector) -> Vector:
    """Return parts times the first: all are positive if and only if they have one sign."""
    return [parts[0] * part for part in parts]


def least_singular_value(arc: Arc, claim: Any) -> Vector:
    """Return the leading minors of M M' - σ² 1 at both ends, less what M M' leaves lines by.

    M M' is the sum of C u u' C' over the rotors, and (u u')'' at most 2 rate² + bend.
    """
    floor = enclosed(claim["at_least"] ** 2)
    minors = []
    for wrenches in arc.ends:
        matrix = gram(wrenches)
        for i, row in enumerate(matrix):
            for j in range(4):
                row[j] -= dot(arc.bents, [square[i][j] for square in arc.level.squares])
            row[i] -= floor
        for size in (1, 2, 3, 4):
            minor = [row[:size] for row in matrix[:size]]
            minors.append(determinant(minor))
    return minors


def sign_of_R(arc: Arc, claim: Any) -> Vector:
    """Return R or its negative, up to a positive factor."""
    sign = enclosed(arc.level.sign * SIGNS[claim["sign"]])
    return [sign * values[4] for values in arc.hovers]


def hover_thrust(arc: Arc, claim: Any) -> Vector:
    """Return the vertical force and how far thrusts are within bounds, all with its sign."""
    least = enclosed(claim["at_least"])
    most = enclosed(claim["at_most"])
    parts = []
    for *thrusts, lift, _, _ in arc.hovers:
        parts.append(lift)
        for thrust in thrusts:
            parts.append(thrust - least * lift)
            parts.append(most * lift - thrust)
    return alike(parts)


def attitude(arc: Arc, claim: Any) -> Vector:
    """Return what is positive if the force is within a quarter turn of each vertical."""
    cosine, sine = turn_by(claim["tilt"])
    lifts = []
    parts = [cosine]
    for *_, z, x, y in arc.hovers:
        lifts.append(z)
        up = z * cosine
        parts.append(up * up - (x * x + y * y) * sine * sine)
    return alike(lifts) + parts


PROOFS = {
    "least_singular_value": least_singular_value,
    "sign_of_R": sign_of_R,
    "hover_thrust": hover_thrust,
    "attitude": attitude,
}


def bernstein(curve: Polynomial) -> Polynomial:
    """Return the coefficients between whose least and largest a polynomial is on [0, 1]."""
    degree = len(curve) - 1
    points = []
    for row in range(degree + 1):
        point = ZERO
        for k, a in enumerate(curve):
            point += a * comb(row, k) / comb(degree, k)  # 0 for k > row
        points.append(point)
    return points


def is_within(curves: list[Polynomial], claim: Any) -> bool:
    """Return whether polynomials on [0, 1] are within bounds of their own."""
    ranges = zip(curves, claim["at_least"], claim["at_most"], strict=True)
    for curve, least, most in ranges:
        points = bernstein(curve)
        if min(points) < least or max(points) > most:
            return False
    return True


def proves(piece: Piece, name: str, claim: Any, start: Fraction, end: Fraction) -> bool:
    """Return whether a claim holds on an interval of a piece."""
    if name in ORDERS:
        curves = piece.motion[ORDERS[name]]
        return is_within([moved(curve, start, end - start) for curve in curves], claim)
    parts = PROOFS[name](arc_on(piece, start, end), claim)
    return all(part.low > 0 for part in parts)


def standing(piece: Piece, share: Fraction) -> Piece:
    """Return a piece that stands still where another one is at a share of its duration."""
    still = [[angle] for angle in piece.at(share)]
    return Piece({"alpha": still, "duration": Fraction(1)}, piece.level)


def with_neighbours(pieces: list[Piece], path: str) -> list[Piece]:
    """Return pieces and what they join: each other, or of an open path two that stand still."""
    if path == "closed":
        return [pieces[-1], *pieces]
    before = standing(pieces[0], ZERO)
    after = standing(pieces[-1], Fraction(1))
    return [before, *pieces, after]


def jump(before: Piece, after: Piece, order: int) -> Fraction:
    """Return by how much angles or a derivative jump at most from a piece to the next."""
    ended = before.at(Fraction(1), order)
    begun = after.at(ZERO, order)
    return max(abs(a - b) for a, b in zip(ended, begun, strict=True))


def broken_joint(pieces: list[Piece], path: str, claim: Any) -> str:
    """Return where pieces first do not join as is claimed, "" if they do.

    At the ends of an open path rates do not jump, whatever is claimed.
    """
    for k, joint in enumerate(pairwise(with_neighbours(pieces, path))):
        limits = [ZERO, claim["rate_jump"], claim["acceleration_jump"]]
        if path == "open" and k in (0, len(pieces)):
            limits[1] = ZERO
        for order, most in enumerate(limits):
            if jump(*joint, order) > most:
                return f"at the start of piece {k}"
    return ""


def named_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of JSON; ValueError if it has a name twice."""
    if len(dict(pairs)) < len(pairs):
        raise ValueError("names of an object must differ, got one twice")
    return dict(pairs)


def parsed(value: Any, form: Any, what: str) -> Any:
    """Return a value of a form, its numbers as fractions."""
    if form is VEHICLES:
        has_own_axes = isinstance(value, dict) and "spins" in value
        form = VEHICLES[has_own_axes]
    if isinstance(form, dict):
        needed = {"joints"} if form is CLAIMS else set(form)
        if isinstance(value, dict) and needed <= set(value) <= set(form):
            return {name: parsed(one, form[name], name) for name, one in value.items()}
        rule = f"an object with the names {', '.join(form)}, each once"
    elif isinstance(form, list):
        counts = form[1:]
        if isinstance(value, list) and value and len(value) in (counts or [len(value)]):
            return [parsed(one, form[0], what) for one in value]
        rule = f"a list of {' or '.join(map(str, counts)) or 'some'} values"
    else:
        if isinstance(value, str) and re.fullmatch(PATTERNS.get(form, form), value):
            return Fraction(value) if form in (NUMBER, POSITIVE) else value
        rule = form
    raise ValueError(f"{what} must be {rule}, got {repr(value)[:60]}")


def read(text: str) -> dict[str, Any]:
    """Return a document, its numbers as fractions; ValueError if it is no certificate."""
    document = json.loads(text, object_pairs_hook=named_once)
    whole: dict[str, Any] = parsed(document, FORM, "the document")
    pieces, claims = whole["pieces"], whole["claims"]
    longest = max(len(curve) for piece in pieces for curve in piece["alpha"])
    if longest > 64:
        raise ValueError(f"alpha must have at most 64 coefficients, got {longest}")
    for name in claims.keys() - {"joints"}:
        cover = claims[name]["cover"]
        if len(cover) != len(pieces):
            rule = f"have {len(pieces)} pieces"
            raise ValueError(f"cover of {name} must {rule}, got {len(cover)}")
        for k, breaks in enumerate(cover):
            if breaks != sorted(set(breaks)) or (breaks[0], breaks[-1]) != (0, 1):
                rule = f"rise from 0 to 1 on piece {k}"
                raise ValueError(f"cover of {name} must {rule}, got another")
    return whole


def pieces_of(whole: dict[str, Any]) -> list[Piece]:
    """Return the pieces of a document."""
    level = Level(whole["vehicle"])
    return [Piece(piece, level) for piece in whole["pieces"]]


def unproved(whole: dict[str, Any]) -> dict[str, str]:
    """Return for each claim the first place where it is not proved, "" if there is none."""
    pieces = pieces_of(whole)
    claims = whole["claims"]
    places = dict.fromkeys(claims, "")
    places["joints"] = broken_joint(pieces, whole["path"], claims["joints"])
    for k, piece in enumerate(pieces):
        for name in claims.keys() - {"joints"}:
            claim = claims[name]
            for start, end in pairwise(claim["cover"][k]):
                if not (places[name] or proves(piece, name, claim, start, end)):
                    places[name] = f"on piece {k} from {start} to {end}"
    return places


def check(text: str) -> dict[str, Any]:
    """Return of which vehicle what is proved, and first places where it is not."""
    whole = read(text)
    stated = json.loads(text)
    values = stated["claims"]
    places = unproved(whole)
    lines = [f"vehicle {json.dumps(stated['vehicle'])}", PATHS[stated["path"]]]
    for name, place in places.items():
        values[name].pop("cover", None)
        verdict = "NOT proved" if place else "proved"
        lines.append(f"{verdict}: {name} {json.dumps(values[name])} {place}".strip())
    lacking = []
    for name, limit in FLYABLE.items():
        if name not in values:
            lacking.append(f"no claim of {name}")
        elif whole["claims"][name]["at_least"] < limit:
            least = values[name]["at_least"]
            lacking.append(f"{name} at least {least}, below {float(limit):g}")
    proved = not any(places.values())
    if proved and lacking:
        lines.append(f"not proved flyable: {', '.join(lacking)}")
    return {
        "proved": proved,
        "flyable": proved and not lacking,
        "claims": places,
        "path": stated["path"],
        "deviation": float(whole["deviation"]),
        "vehicle": stated["vehicle"],
        "values": values,
        "lines": lines,
    }


class Row(NamedTuple):
    """A row of a table: time [s], four angles, and what each may be off by [rad]."""

    t: Fraction
    angles: list[Fraction]
    slacks: list[Fraction]


def even_or_own(rows: list[Row], half_unit: Fraction, period: Fraction) -> list[Row]:
    """Return rows at even times if theirs are these, rounded to units; else as they are.

    Half a unit is at most a hundredth of a step, so that rows at their own times are at most
    2 % faster.
    """
    first = rows[0].t
    step = period / max(len(rows) - 1, 1)
    if half_unit > step / 100:
        return rows
    even = [row._replace(t=first + k * step) for k, row in enumerate(rows)]
    late = [row.t - other.t for row, other in zip(rows, even, strict=True)]
    if max(map(abs, late)) <= half_unit * Fraction("1.000001"):
        return even
    # A first time that is not 0 is rounded too.
    is_moved = first != 0 and max(late) - min(late) <= half_unit * Fraction("1.999")
    return even if is_moved else rows


class Curve:
    """The curve of a certificate from a time on; `times` are those of the pieces' ends [s]."""

    def __init__(self, whole: dict[str, Any], start: Fraction) -> None:
        self.pieces = pieces_of(whole)
        durations = [piece.duration for piece in self.pieces]
        self.times = list(accumulate(durations, initial=start))
        self.period = sum(durations, ZERO)

    def distances(self, time: Fraction, angles: list[Fraction]) -> list[Fraction]:
        """Return how far angles are from those of the curve [rad]."""
        k = min(bisect_right(self.times, time), len(self.pieces)) - 1
        piece = self.pieces[k]
        curve = piece.at((time - self.times[k]) / piece.duration)
        return [abs(a - b) for a, b in zip(angles, curve, strict=True)]


def first_off(curve: Curve, rows: list[Row], deviation: Fraction) -> str:
    """Return the first row that is not on a curve at its time, "" if all are."""
    for number, row in enumerate(rows, 1):
        place = f"row {number}, t = {float(row.t):.9g} s"
        if number > 1 and row.t <= rows[number - 2].t:
            return f"{place}, is not after the row before it"
        for joint, distance in enumerate(curve.distances(row.t, row.angles)):
            most = deviation + row.slacks[joint]
            if distance > most:
                how = f"{float(distance):.3g} rad off the curve, allowed is {float(most):.3g}"
                return f"{place}: alpha{joint + 1} is {how}"
    seconds = rows[-1].t - rows[0].t
    if abs(seconds - curve.period) > (curve.period + 2) / 10**9:
        whole = f"{float(seconds):.9g} s, the curve {float(curve.period):.9g} s"
        return f"the rows last {whole}"
    return ""


def held_against(
    text: str, rows: list[Row], half_unit: Fraction = ZERO
) -> tuple[str, float]:
    """Return the first row that is not on a certificate's curve at its time, "" if all are.

    An angle may be off by the certificate's deviation and the row's slack. The first row is
    at the start. Times in units of twice `half_unit` [s] may be the even times of the curve.
    The second value is how far the middles of lines between rows are from it at most [rad].
    """
    whole = read(text)
    if "rate" not in whole["claims"]:
        raise ValueError("claims must have a rate to compare a table, got none")
    curve = Curve(whole, rows[0].t)
    rows = even_or_own(rows, half_unit, curve.period)
    between = ZERO
    for before, row in pairwise(rows):
        middles = [(a + b) / 2 for a, b in zip(before.angles, row.angles, strict=True)]
        distances = curve.distances((before.t + row.t) / 2, middles)
        between = max(between, *distances)
    return first_off(curve, rows, whole["deviation"]), float(between)


def rows_of_csv(path: Path) -> tuple[list[Row], Fraction]:
    """Return the rows of a CSV file (s, rad) and half a unit of its times, or ValueError."""
    names = ["t", "alpha1", "alpha2", "alpha3", "alpha4"]
    rows, unit = [], Fraction(1)
    with path.open(encoding="utf-8-sig", newline="") as stream:
        try:
            for line in csv.DictReader(stream, strict=True):
                texts = [line[name] for name in names]
                if re.search("[eE][-+]?[0-9]{4}", " ".join(texts)):
                    raise ValueError("exponents must have three digits at most")
                numbers = list(map(Fraction, texts))
                t = numbers[0]
                rows.append(Row(t, numbers[1:], [ZERO] * 4))
                while unit.denominator < 10**60 and t % unit:
                    unit /= 10
        except (csv.Error, KeyError, TypeError, ValueError, ZeroDivisionError) as error:
            rule = f"must hold numbers in columns {', '.join(names)} (s, rad)"
            raise ValueError(f"{path.name} {rule}: {error}") from None
    if not rows:
        raise ValueError(f"{path.name} must have rows, got none")
    return rows, unit / 2


if __name__ == "__main__":
    try:
        if len(sys.argv) not in (2, 3):
            raise ValueError("usage: python check.py gait.cert.json [gait.csv]")
        document = Path(sys.argv[1]).read_text(encoding="utf-8-sig")
        found = check(document)
        off = ""
        last = "no table was compared"
        if len(sys.argv) == 3:
            off, between = held_against(document, *rows_of_csv(Path(sys.argv[2])))
            near = f"each row is on the curve to {found['deviation']:.2g} rad"
            last = f"{near}, lines between rows to {between:.2g} rad"
    except (OSError, OverflowError, RecursionError, ValueError) as error:
        print(f"check.py: {error}", file=sys.stderr)
        sys.exit(2)
    if off:
        last = f"NOT on the curve: {off}"
    print("\n".join(found["lines"] + [last]))
    sys.exit(int(bool(off) or not found["proved"]))

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
from math import isqrt, perm
from pathlib import Path
from typing import Any, NamedTuple

ONE, ZERO = 1 << 96, Fraction(0)  # enclosures are integers times 1 / ONE
HALVINGS = 6  # of an interval on which a claim is not proved at once
# The form of a document: objects by their names, lists by what is in them and the range
# of their lengths, texts by a pattern, and the two forms of a vehicle.
DIGITS = r"[0-9]{1,40}(\.[0-9]{1,60}|/[1-9][0-9]{0,59})?"
NUMBER = "an exact number in a text"  # a decimal or a fraction
POSITIVE = "a positive exact number in a text"
TEXT = "a text of at most 1000 characters"
PATTERNS = {NUMBER: f"-?{DIGITS}", POSITIVE: f"(?=[0-9.]*[1-9]){DIGITS}"}
PATTERNS[TEXT] = "(?s:.{0,1000})"
COVER = {"cover": [[NUMBER, 2, 10**6], 1, 10**6]}
FOUR = {"at_least": [NUMBER, 4, 5], "at_most": [NUMBER, 4, 5], **COVER}
ORDERS = {"tilt": 0, "rate": 1, "acceleration": 2, "jerk": 3}  # derivatives by time
JUMPS = ("rate_jump", "acceleration_jump")
CLAIMS: dict[str, Any] = {
    **dict.fromkeys(ORDERS, FOUR),
    "least_singular_value": {"at_least": POSITIVE, **COVER},
    "sign_of_R": {"sign": "positive|negative", **COVER},
    "hover_thrust": {"at_least": NUMBER, "at_most": NUMBER, **COVER},
    "attitude": {"tilt": NUMBER, **COVER},
    "joints": dict.fromkeys(JUMPS, NUMBER),
}
NAME = {"name": TEXT, "first_rotor_spin": "clockwise|counterclockwise"}
CONSTANTS = ("drag_coefficient", "thrust_coefficient", "arm_length")
EQUAL_ARMS = {**dict.fromkeys(CONSTANTS, POSITIVE), "rotor_height": NUMBER}
PLACES = [[NUMBER, 3, 4], 4, 5]
ANY_ARMS = {"rotor_positions": PLACES, "drag_to_thrust": [POSITIVE, 4, 5]}
PIECE = {"alpha": [[NUMBER, 1, 25], 2, 5, 2], "duration": POSITIVE}
FORM = {
    "format": "gaitgraph certificate 1",
    "made_by": TEXT,
    "deviation": NUMBER,
    "vehicle": ({**NAME, **EQUAL_ARMS}, {**NAME, **ANY_ARMS}),
    "law": [NUMBER, 2, 7],
    "pieces": [PIECE, 1, 10**6],
    "claims": CLAIMS,
}
LAWS = [[0, 1], [0, 0, 0, 10, -15, 6]]  # both rise from 0 to 1
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
        (a, b), (c, d) = self, other
        ends = (a * c, a * d, b * c, b * d)
        return Enclosure(min(ends) >> 96, -(-max(ends) >> 96))

    def inverse(self) -> Enclosure:
        """Return the reciprocal of a positive number."""
        return Enclosure(ONE**2 // self.high, -(-(ONE**2) // self.low))

    def size(self) -> int:
        """Return what the number is at most in size."""
        return max(-self.low, self.high)

    def widened(self, size: int) -> Enclosure:
        """Return what encloses all that is at most so far from the number."""
        return Enclosure(self.low - size, self.high + size)


Vector = list[Enclosure]
Curves = list[list[Fraction]]  # polynomials, the lowest power first
NONE = Enclosure(0, 0)


def enclosed(number: Fraction | int) -> Enclosure:
    """Return the least enclosure of an exact number."""
    return Enclosure(number * ONE // 1, -(-number * ONE // 1))


def root(square: Fraction) -> Enclosure:
    """Return the square root of an exact number that is not negative."""
    below = isqrt(square * ONE**2 // 1)
    return Enclosure(below, below + 1)


@lru_cache(maxsize=4096)
def turn_by(angle: Fraction) -> Vector:
    """Return the cosine and the sine of an angle, by Taylor's formula."""
    if abs(angle) > 4:
        raise ValueError(f"angles must be at most 4 rad in size, got {float(angle):g}")
    sums = [NONE, NONE]
    power, term = 0, enclosed(1)  # angle^power / power!
    while term.size() > 1:
        sign = enclosed((1, 1, -1, -1)[power % 4])
        sums[power % 2] += sign * term
        power += 1
        term *= enclosed(angle / power)
    return [one.widened(term.size()) for one in sums]


def determinant(rows: list[Vector]) -> Enclosure:
    """Return the determinant of a matrix, expanded by its first row."""
    total = NONE
    for column, entry in enumerate(rows[0]):
        minor = [row[:column] + row[column + 1 :] for row in rows[1:]]
        part = entry * determinant(minor) if minor else entry
        total = total - part if column % 2 else total + part
    return total


def columns_of(vehicle: dict[str, Any]) -> tuple[Enclosure, list[list[Vector]]]:
    """Return κ, and per thrust of each rotor, at α = 0 and a quarter turn, moment and force.

    Moments [arm length] and forces are about and along the three body axes.
    """
    if "arm_length" in vehicle:
        arm, height = vehicle["arm_length"], vehicle["rotor_height"]
        drags = [vehicle["drag_coefficient"] / vehicle["thrust_coefficient"]] * 4
        ends = [(arm, 0), (0, arm), (-arm, 0), (0, -arm)]
        places = [(x, y, height) for x, y in ends]
    else:
        drags, places = vehicle["drag_to_thrust"], vehicle["rotor_positions"]
    lengths = [root(x * x + y * y) for x, y, _ in places]
    if min(lengths).low <= 0:
        raise ValueError("rotor_positions must be off body z, got one on it")
    scale = (sum(lengths, NONE) * enclosed(Fraction(1, 4))).inverse()
    spin = 1 if vehicle["first_rotor_spin"] == "clockwise" else -1
    columns = []
    for rotor, (place, length) in enumerate(zip(places, lengths, strict=True)):
        ahead, left, _ = (enclosed(part) * length.inverse() for part in place)
        x, y, z = (enclosed(part) * scale for part in place)
        drag = enclosed(spin * (-1) ** rotor * drags[rotor]) * scale
        pair = []
        for fx, fy, fz in ((NONE, NONE, enclosed(1)), (left, NONE - ahead, NONE)):
            roll = y * fz - z * fy + drag * fx
            pitch = z * fx - x * fz + drag * fy
            yaw = x * fy - y * fx + drag * fz
            pair.append([roll, pitch, yaw, fx, fy, fz])
        columns.append(pair)
    return enclosed(spin * sum(drags) / 4) * scale, columns


class Level:
    """Level flight of a vehicle: tables of numbers from which every claim follows.

    A table holds the values of a form, which is linear in (cos α, sin α) of rotors, where
    each α is 0 or a quarter turn, the last one changing first. `inputs` are the thrusts that
    make no moment, each without its own α, and `force` is their force in body axes.
    """

    def __init__(self, vehicle: dict[str, Any]) -> None:
        self.kappa, columns = columns_of(vehicle)
        self.inputs, self.force = [], []
        for rotor in range(4):
            others = [[one[:3] for one in pair] for pair in columns]
            del others[rotor]
            sign = enclosed((-1) ** (rotor + 1))
            minors = [determinant(list(corner)) for corner in product(*others)]
            self.inputs.append([sign * minor for minor in minors])
        for axis in (3, 4, 5):  # the last leaves the columns of the level matrix
            self.matrix = [[[*m[:3], m[axis]] for m in pair] for pair in columns]
            corners = product(*self.matrix)
            self.force.append([determinant(list(corner)) for corner in corners])


def across(curve: list[Fraction], start: Fraction, end: Fraction) -> list[Fraction]:
    """Return a polynomial as one of u in [-1, 1], from start to end."""
    middle, half = (start + end) / 2, (end - start) / 2
    out: list[Fraction] = []
    for coefficient in reversed(curve):
        pairs = zip([*out, ZERO], [ZERO, *out], strict=True)
        out = [middle * one + half * lower for one, lower in pairs]
        out[0] += coefficient
    return out


class Arc:
    """An interval of a curve: turns at both ends; by u in [-1, 1], rates and bends of α."""

    def __init__(self, curves: Curves, start: Fraction, end: Fraction) -> None:
        found = [across(curve, start, end) for curve in curves]
        sums = [(sum(one[::2]), sum(one[1::2])) for one in found]
        befores = [turn_by(even - odd) for even, odd in sums]
        self.ends = [befores, [turn_by(even + odd) for even, odd in sums]]
        sizes = [[*enumerate(map(abs, one))] for one in found]
        self.rates = [sum((k * a for k, a in one), ZERO) for one in sizes]
        self.bends = [sum((k * (k - 1) * a for k, a in one), ZERO) for one in sizes]

    def values(self, table: Vector, own: int = 4) -> Vector:
        """Return a form at both ends, widened by what it leaves the line between them.

        No second derivative by angles exceeds the root of the sum of the table's squares.
        """
        most = isqrt(sum(entry.size() ** 2 for entry in table)) + 1
        leaves = -(-most * (sum(self.rates) ** 2 + sum(self.bends)) // 2)
        out = []
        for turns in self.ends:
            values = table
            for cosine, sine in turns[:own] + turns[own + 1 :]:
                half = len(values) // 2
                pairs = zip(values[:half], values[half:], strict=True)
                values = [one * cosine + other * sine for one, other in pairs]
            out.append(values[0].widened(leaves))
        return out


def least_singular_value(level: Level, arc: Arc, claim: Any) -> Vector:
    """Return the leading minors of M M' - σ² 1 at both ends, less what M M' leaves lines by.

    M M' is the sum of C u u' C' over the rotors, and (u u')'' at most 2 rate² + bend.
    """
    floor = enclosed(claim["at_least"] ** 2)
    minors = []
    for turns in arc.ends:
        gram = [[NONE] * 4 for _ in range(4)]
        for rotor, (first, last) in enumerate(level.matrix):
            cosine, sine = turns[rotor]
            m = [x * cosine + y * sine for x, y in zip(first, last, strict=True)]
            bent = enclosed(arc.rates[rotor] ** 2 + arc.bends[rotor] / 2)
            for i, j in product(range(4), repeat=2):
                lost = bent * (first[i] * first[j] + last[i] * last[j])
                gram[i][j] += m[i] * m[j] - lost
        for k in range(4):
            gram[k][k] -= floor
            minors.append(determinant([row[: k + 1] for row in gram[: k + 1]]))
    return minors


def sign_of_R(level: Level, arc: Arc, claim: Any) -> Vector:
    """Return κ times the vertical force, or its negative: R is half their quotient."""
    sign = enclosed(1 if claim["sign"] == "positive" else -1)
    return [sign * level.kappa * lift for lift in arc.values(level.force[2])]


def hover_thrust(level: Level, arc: Arc, claim: Any) -> Vector:
    """Return the vertical force and how far thrusts are within bounds, all with its sign."""
    lifts = arc.values(level.force[2])
    least, most = enclosed(claim["at_least"]), enclosed(claim["at_most"])
    parts = [*lifts]
    for rotor, table in enumerate(level.inputs):
        for thrust, lift in zip(arc.values(table, rotor), lifts, strict=True):
            parts += [thrust - least * lift, most * lift - thrust]
    sign = enclosed(1 if lifts[0].low > 0 else -1)
    return [sign * part for part in parts]


def attitude(level: Level, arc: Arc, claim: Any) -> Vector:
    """Return what is positive if the force is within a quarter turn of each vertical."""
    cosine, sine = turn_by(claim["tilt"])
    forces = zip(*(arc.values(table) for table in level.force), strict=True)
    lifts = arc.values(level.force[2])
    sign = enclosed(1 if lifts[0].low > 0 else -1)
    parts = [cosine, *(sign * lift for lift in lifts)]
    for x, y, z in forces:
        up = z * cosine
        parts.append(up * up - (x * x + y * y) * sine * sine)
    return parts


PROOFS = [least_singular_value, sign_of_R, hover_thrust, attitude]


def is_within(curves: Curves, start: Fraction, end: Fraction, claim: Any) -> bool:
    """Return whether each of four polynomials is within its bounds."""
    for joint, curve in enumerate(curves):
        middle, *rest = across(curve, start, end)
        odd, even = rest[::2], rest[1::2]  # powers of u: from -1 to 1, and from 0 to 1
        reach = sum(map(abs, odd))
        low = middle - reach + sum(min(one, ZERO) for one in even)
        high = middle + reach + sum(max(one, ZERO) for one in even)
        if low < claim["at_least"][joint] or high > claim["at_most"][joint]:
            return False
    return True


def motion(piece: Any, law: list[Fraction], order: int) -> Curves:
    """Return the angles by s, or a derivative by time by the share of a piece's duration."""
    curves: Curves = (piece["alpha"] * 2)[:4]
    if order == 0:
        return curves
    if len(law) > 2:  # pieces are straight
        curves = [[ZERO, *(sum(a[1:]) * rise for rise in law[1:])] for a in curves]
    unit = piece["duration"] ** order
    return [
        [perm(k, order) * a / unit for k, a in enumerate(one)][order:] or [ZERO]
        for one in curves
    ]


def proves(
    name: str, claim: Any, level: Level, curves: Curves, start: Fraction, end: Fraction
) -> bool:
    """Return whether a claim holds on an interval of angles, or of their derivatives."""
    for proof in PROOFS:
        if proof.__name__ == name:
            parts = proof(level, Arc(curves, start, end), claim)
            return all(part.low > 0 for part in parts)
    return is_within(curves, start, end, claim)


def jumps(pieces: Any, law: list[Fraction], order: int) -> Curves:
    """Return by how much angles, or a derivative by time, jump at the start of each piece."""
    curves = [motion(piece, law, order) for piece in pieces]
    return [
        [abs(sum(a) - b[0]) for a, b in zip(before, after, strict=True)]
        for before, after in pairwise([curves[-1], *curves])
    ]


def jump(whole: dict[str, Any]) -> str:
    """Return the first joint that jumps by more than stated, "" if there is none."""
    claim = whole["claims"]["joints"]
    limits = [ZERO, *(claim[name] for name in JUMPS)]
    for order, most in enumerate(limits):
        for k, sizes in enumerate(jumps(whole["pieces"], whole["law"], order)):
            if max(sizes) > most:
                return f"at the start of piece {k}"
    return ""


def gap(whole: dict[str, Any], level: Level, name: str) -> str:
    """Return the first interval where a claim is not proved, "" if there is none."""
    claim, pieces = whole["claims"][name], whole["pieces"]
    if len(claim["cover"]) != len(pieces):
        raise ValueError(f"cover of {name} must have {len(pieces)} pieces, got others")
    for k, breaks in enumerate(claim["cover"]):
        if breaks != sorted({*breaks}) or (breaks[0], breaks[-1]) != (0, 1):
            rule = f"rise from 0 to 1 on piece {k}"
            raise ValueError(f"cover of {name} must {rule}, got another")
        curves = motion(pieces[k], whole["law"], ORDERS.get(name, 0))
        todo = [(*ends, HALVINGS) for ends in pairwise(breaks)]
        for start, end, halvings in todo:
            if proves(name, claim, level, curves, start, end):
                continue
            if halvings == 0:
                return f"on piece {k} from {start} to {end}"
            middle = (start + end) / 2
            todo += [(start, middle, halvings - 1), (middle, end, halvings - 1)]
    return ""


def named_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of JSON; ValueError if it has a name twice."""
    if len(dict(pairs)) < len(pairs):
        raise ValueError("names of an object must differ, got one twice")
    return dict(pairs)


def parsed(value: Any, form: Any, what: str) -> Any:
    """Return a value of a form, its numbers as fractions."""
    if isinstance(form, tuple):
        form = form[isinstance(value, dict) and "rotor_positions" in value]
    if isinstance(form, dict):
        needed = {"joints"} if form is CLAIMS else {*form}
        if isinstance(value, dict) and needed <= {*value} <= {*form}:
            return {name: parsed(one, form[name], name) for name, one in value.items()}
        rule = f"an object with the names {', '.join(form)}, each once"
    elif isinstance(form, list):
        lengths = range(*form[1:])
        if isinstance(value, list) and len(value) in lengths:
            return [parsed(one, form[0], what) for one in value]
        rule = (
            f"a list of {lengths[0]} {'or' if form[3:] else 'to'} {lengths[-1]} values"
        )
    else:
        if isinstance(value, str) and re.fullmatch(PATTERNS.get(form, form), value):
            return Fraction(value) if form in (NUMBER, POSITIVE) else value
        rule = form
    raise ValueError(f"{what} must be {rule}, got {repr(value)[:60]}")


def read(text: str) -> dict[str, Any]:
    """Return a document, its numbers as fractions; ValueError if it is no certificate."""
    document = json.loads(text, object_pairs_hook=named_once)
    whole: dict[str, Any] = parsed(document, FORM, "the document")
    curved = any(len(one) > 2 for piece in whole["pieces"] for one in piece["alpha"])
    if whole["law"] not in (LAWS[:1] if curved else LAWS):
        raise ValueError("law must be 0, 1, or smooth on straight pieces, got another")
    return whole


def check(text: str) -> dict[str, Any]:
    """Return of which vehicle what is proved, and first places where it is not."""
    whole, stated = read(text), json.loads(text)
    level, values = Level(whole["vehicle"]), stated["claims"]
    lines, places = [f"vehicle {json.dumps(stated['vehicle'])}"], {}
    for name in values:
        values[name].pop("cover", None)
        place = jump(whole) if name == "joints" else gap(whole, level, name)
        verdict = "NOT proved" if place else "proved"
        lines.append(f"{verdict}: {name} {json.dumps(values[name])} {place}".strip())
        places[name] = place
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
    found = {"proved": proved, "flyable": proved and not lacking, "claims": places}
    return found | {"vehicle": stated["vehicle"], "values": values, "lines": lines}


class Row(NamedTuple):
    """A row of a table: time [s], four angles, and what each may be off by [rad]."""

    t: Fraction
    angles: list[Fraction]
    slacks: list[Fraction]


def value_at(polynomial: list[Fraction], at: Fraction) -> Fraction:
    """Return the value of a polynomial: its constant term about there."""
    return across(polynomial, at, at)[0]


def even_or_own(rows: list[Row], half_unit: Fraction, period: Fraction) -> list[Row]:
    """Return rows at even times if theirs are these, rounded to units; else as they are."""
    first, step = rows[0].t, period / max(len(rows) - 1, 1)
    even = [row._replace(t=first + k * step) for k, row in enumerate(rows)]
    late = [row.t - other.t for row, other in zip(rows, even, strict=True)]
    if max(map(abs, late)) <= half_unit * Fraction("1.000001"):
        return even
    # A first time that is not 0 is rounded too.
    is_moved = first != 0 and max(late) - min(late) <= half_unit * Fraction("1.999")
    return even if is_moved else rows


def held_against(
    text: str, rows: list[Row], half_unit: Fraction = ZERO
) -> tuple[str, float]:
    """Return the first row that is not on a certificate's curve at its time, "" if all are.

    An angle may be off by the certificate's deviation and the row's slack. The first row is
    at the start. Times in units of twice `half_unit` [s] may be the even times of the curve.
    The second value is how far the middles of lines between rows are from it at most [rad].
    """
    whole = read(text)
    pieces, law = whole["pieces"], whole["law"]
    if "rate" not in whole["claims"]:
        raise ValueError(
            "claims must have a rate to compare a table, got none: untimed"
        )
    ends = list(accumulate(piece["duration"] for piece in pieces))
    rows = even_or_own(rows, half_unit, ends[-1])

    def off_curve(time: Fraction, angles: list[Fraction]) -> list[Fraction]:
        k = min(bisect_right(ends, time - rows[0].t), len(pieces) - 1)
        left = (ends[k] - (time - rows[0].t)) / pieces[k]["duration"]
        s = value_at(law, 1 - left)
        curve = [value_at(one, s) for one in motion(pieces[k], law, 0)]
        return [abs(a - b) for a, b in zip(angles, curve, strict=True)]

    off, between = "", ZERO
    for number, row in enumerate(rows, 1):
        if number > 1:
            before = rows[number - 2]
            middle = [(a + b) / 2 for a, b in zip(before[1], row[1], strict=True)]
            between = max(between, *off_curve((before.t + row.t) / 2, middle))
            if row.t <= before.t:
                off = f"row {number} is not after the row before it"
        for joint, distance in enumerate(off_curve(row.t, row.angles)):
            most = whole["deviation"] + row.slacks[joint]
            if distance > most and not off:
                place = f"row {number}, t = {float(row.t):.9g} s: alpha{joint + 1} = "
                how = f"{float(distance):.3g} rad off the curve, allowed is {float(most):.3g}"
                off = f"{place}{float(row.angles[joint]):.9g} is {how}"
        if off:
            return off, float(between)
    seconds = rows[-1].t - rows[0].t
    if abs(seconds - ends[-1]) > (ends[-1] + 2) / 10**9:
        off = f"the rows last {float(seconds):.9g} s, the curve {float(ends[-1]):.9g} s"
    return off, float(between)


def rows_of_csv(path: Path) -> tuple[list[Row], Fraction]:
    """Return the rows of a CSV file (s, rad) and half a unit of its times, or ValueError."""
    names = ["t", "alpha1", "alpha2", "alpha3", "alpha4"]
    with path.open(encoding="utf-8-sig", newline="") as stream:
        table = csv.DictReader(stream, strict=True)
        if not {*names} <= {*(table.fieldnames or ())}:
            rule = f"columns must be {', '.join(names)} (s, rad)"
            raise ValueError(
                f"{rule}, got {table.fieldnames}; gaitgraph verify reads others"
            )
        try:
            numbers = [[Fraction(row[name]) for name in names] for row in table]
        except (csv.Error, TypeError, ValueError, ZeroDivisionError) as error:
            raise ValueError(f"{path.name} must hold numbers: {error}") from None
    if not numbers:
        raise ValueError(f"{path.name} must have rows, got none")
    decimals = 0
    while decimals < 60 and any(t * 10**decimals % 1 for t, *_ in numbers):
        decimals += 1
    rows = [Row(t, angles, [ZERO] * 4) for t, *angles in numbers]
    return rows, Fraction(1, 2 * 10**decimals)


if __name__ == "__main__":
    try:
        if len(sys.argv) not in (2, 3):
            raise ValueError("usage: python check.py gait.cert.json [gait.csv]")
        document = Path(sys.argv[1]).read_text(encoding="utf-8-sig")
        found = check(document)
        off, last = "", "no table was compared"
        if len(sys.argv) == 3:
            off, between = held_against(document, *rows_of_csv(Path(sys.argv[2])))
            last = f"each row is on the curve, lines between rows to {between:.2g} rad"
    except (OSError, RecursionError, ValueError) as error:
        print(f"check.py: {error}", file=sys.stderr)
        sys.exit(2)
    print("\n".join([*found["lines"], f"NOT on the curve: {off}" if off else last]))
    sys.exit(int(bool(off) or not found["proved"]))

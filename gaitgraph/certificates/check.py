"""Check a gait's certificate with the standard library, and that the rows of a CSV table are on its curve.

The exit code is 0 if all is proved, 1 if not, 2 if a file is no certificate or no table.
"""

from __future__ import annotations

import csv
import json
import re
import sys
from bisect import bisect_right
from fractions import Fraction
from functools import lru_cache, partial
from itertools import accumulate, combinations, pairwise, zip_longest
from math import comb, lcm, perm
from pathlib import Path
from typing import Any, NamedTuple

ONE, ZERO = 1 << 96, Fraction(0)  # bounds of sines and so on are integers times 1 / ONE
NUMBER, POSITIVE = (
    "an exact number in a text",
    "a positive exact number in a text",
)  # decimals or fractions
TEXT = "a text of at most 1000 characters"
DIGIT = r"[0-9]{1,40}(\.[0-9]{1,60}|/[1-9][0-9]{0,59})?"
RULES = {
    NUMBER: f"-?{DIGIT}",
    POSITIVE: f"(?=[0-9.]*[1-9]){DIGIT}",
    TEXT: "(?s:.{0,1000})",
}
FOUR, COVER = [NUMBER, 4, 5], {"cover": [[NUMBER, 2, 10**6], 1, 10**6]}
ORDERS = {
    "tilt": 0,
    "rate": 1,
    "acceleration": 2,
    "jerk": 3,
}  # claims about derivatives by time
CLAIMS = {name: {"at_least": FOUR, "at_most": FOUR, **COVER} for name in ORDERS} | {
    "least_singular_value": {"at_least": POSITIVE, **COVER}, "sign_of_R": {"sign": "positive|negative", **COVER},
    "hover_thrust": {"at_least": NUMBER, "at_most": NUMBER, **COVER}, "attitude": {"tilt": NUMBER, **COVER},
    "joints": {"rate_jump": NUMBER, "acceleration_jump": NUMBER},
}  # fmt: skip
CONSTANTS = dict.fromkeys(
    ("drag_coefficient", "thrust_coefficient", "arm_length"), POSITIVE
) | {"rotor_height": NUMBER}
FORM = {  # of a document: objects by their names, lists by what is in them and their lengths, texts by what they match
    "format": "gaitgraph certificate 1", "made_by": TEXT, "deviation": NUMBER,
    "vehicle": {"name": TEXT, **CONSTANTS, "first_rotor_spin": "clockwise|counterclockwise"}, "law": [NUMBER, 2, 9],
    "pieces": [{"alpha": [[NUMBER, 1, 25], 2, 5, 2], "duration": POSITIVE}, 1, 10**6], "claims": CLAIMS,
}  # fmt: skip

FLYABLE = {"least_singular_value": Fraction("0.05"), "hover_thrust": ZERO}
"""What the claims of a flyable gait are at least."""


class Row(NamedTuple):
    """A row of a table: time [s], four tilt angles [rad], and by how much each may be off beside the deviation [rad]."""

    t: Fraction
    angles: list[Fraction]
    slacks: list[Fraction]


class Bounds(NamedTuple):
    """Of a function f of u in [-1, 1]: f(0) is within error of value, (f(u) - f(0)) / u within spread of slope."""

    value: int
    error: int
    slope: int
    spread: int

    def __add__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        return Bounds(*map(int.__add__, self, other))

    def __sub__(self, other: Bounds) -> Bounds:
        return self + Bounds(-other.value, other.error, -other.slope, other.spread)

    def __mul__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        # f g - f0 g0 = (f - f0) (g + g0)/2 + (g - g0) (f + f0)/2, and (g + g0)/2 is within e2 + |g - g0|/2 of g0.
        (v1, e1, s1, r1), (v2, e2, s2, r2) = self, other
        f, g, size1, size2 = abs(s1) + r1, abs(s2) + r2, abs(v1), abs(v2)
        error, spread = (
            size1 * e2 + (size2 + e2) * e1,
            r1 * size2 + r2 * size1 + f * (g + e2 + 1) + g * (e1 + 1),
        )
        return Bounds(
            v1 * v2 >> 96,
            (error >> 96) + 2,
            s1 * v2 + s2 * v1 >> 96,
            (spread >> 96) + 2,
        )


def enclosed(value: Fraction | int, *more: int, under: int = 1) -> Bounds:
    """Return bounds of a polynomial of u, whose coefficients are divided by a number."""
    return Bounds(
        value * ONE // under,
        1,
        sum(more[:1]) * ONE // under,
        sum(map(abs, more[1:])) * ONE // under + 2,
    )


def around(
    polynomial: list[Fraction], low: Fraction, high: Fraction
) -> tuple[list[int], int]:
    """Return a polynomial, the lowest power first, as one of u in [-1, 1]: coefficients times a number, and that."""
    over, under = (
        lcm(*(one.denominator for one in polynomial)),
        lcm(low.denominator, high.denominator),
    )
    start, end = (one.numerator * (under // one.denominator) for one in (low, high))
    out: list[int] = []
    for k, a in enumerate(reversed(polynomial)):  # Horner's scheme
        out = [
            (start + end) * x + (end - start) * y
            for x, y in zip([*out, 0], [0, *out], strict=True)
        ]
        out[0] += a.numerator * (over // a.denominator) * (2 * under) ** k
    return out, over * (2 * under) ** (len(polynomial) - 1)


def sine_and_cosine(angle: Bounds) -> list[Bounds]:
    """Return the sine and the cosine of an angle."""
    a, off, s, r = angle
    if abs(a) > 4 * ONE:
        raise ValueError("angles must be at most 4 rad in size, got a larger one")
    sums, term = [0, ONE], ONE
    for k in range(1, 46):
        term = term * a // (k << 96)  # a^k / k!
        sums[(k + 1) % 2] += -term if k % 4 in (2, 3) else term
    off += 200  # all errors of terms by rounding are below 100 in sum, the remainder is below 4^46 / 46! < 1 / ONE
    # sin(a + d) - sin a = sin d cos a - (1 - cos d) sin a, where 1 - sin(d)/d is in [0, d²/6], (1 - cos d)/|d| in
    # [0, |d|/2]; and cos(a + d) - cos a = -sin d sin a - (1 - cos d) cos a.
    d, out = abs(s) + r, []
    for value, first in ((sums[0], sums[1]), (sums[1], -sums[0])):
        around = (
            (
                (abs(first) + off) * (d * d // (6 << 96) + 1)
                + (abs(value) + off) * (d // 2 + 1)
                >> 96
            )
            + off
            + 1
        )
        out.append(
            Bounds(value, off, s * first >> 96, (d * around + r * abs(first) >> 96) + 2)
        )
    return out


def motion(piece: dict[str, Any], order: int) -> list[list[Fraction]]:
    """Return a derivative by time of the angles on a piece, of the share of its duration; order 0: of s."""
    curves, unit = piece["moved" if order else "alpha"], piece["duration"] ** order
    return [
        [perm(k, order) * a / unit for k, a in enumerate(one)][order:] or [ZERO]
        for one in curves
    ]


def cofactors(*rows: Any) -> tuple[Bounds, ...]:
    """Return the cofactors of the last row of a 4×4 matrix, whose other three are given."""
    one, two, (x, y, z, w) = rows
    a, b, c, d, e, f = (
        one[i] * two[j] - one[j] * two[i] for i, j in combinations(range(4), 2)
    )
    return (
        z * e - y * f - w * d,
        x * f - z * c + w * b,
        y * c - x * e - w * a,
        x * d - y * b + z * a,
    )


@lru_cache(maxsize=4096)
def level_physics(kappa: Bounds, height: Bounds, *angles: Bounds) -> tuple[Any, ...]:
    """Return the level matrix M of Shen, Ma, Tsuchiya (2022), thrusts without torque, their force in body axes."""
    # Rows: torques / (L Kf), y and z negated, and lift / Kf. Thrusts: cofactors of the last, so fz = det M = 2 kappa R.
    none = enclosed(0)
    turned = [
        (s, c, kappa * s, kappa * c, height * s)
        for s, c in map(sine_and_cosine, angles)
    ] * 2
    (
        (s1, c1, p1, q1, h1),
        (s2, c2, p2, q2, h2),
        (s3, c3, p3, q3, h3),
        (s4, c4, p4, q4, h4),
    ) = turned[:4]
    roll, pitch = (
        (h1, c2 - p2, none - h3, p4 - c4),
        (c1 + p1, none - h2, none - c3 - p3, h4),
    )
    yaw, lift = (s1 - q1, s2 + q2, s3 - q3, s4 + q4), (c1, c2, c3, c4)
    t1, t2, t3, t4 = thrusts = cofactors(roll, pitch, yaw)
    force = s2 * t2 - s4 * t4, s3 * t3 - s1 * t1, c1 * t1 + c2 * t2 + c3 * t3 + c4 * t4
    return (roll, pitch, yaw, lift), thrusts, force


def proves(
    name: str,
    claim: Any,
    ratios: tuple[Bounds, Bounds],
    curves: list[list[Fraction]],
    *ends: Fraction,
) -> bool:
    """Return whether a claim holds on an interval, on which the angles or their derivatives are the curves."""
    found, none = [around(one, *ends) for one in curves], enclosed(0)
    if (
        name in ORDERS
    ):  # odd powers of u lie between -1 and 1, even ones between 0 and 1
        least = [
            Fraction(a[0] + sum(min(x, -x * (k % 2)) for k, x in enumerate(a) if k), n)
            for a, n in found
        ] * 2
        most = [
            Fraction(a[0] + sum(max(x, -x * (k % 2)) for k, x in enumerate(a) if k), n)
            for a, n in found
        ] * 2
        return all(map(Fraction.__le__, claim["at_least"], least)) and all(
            map(Fraction.__le__, most, claim["at_most"])
        )
    m, thrusts, (fx, fy, fz) = level_physics(
        *ratios, *(enclosed(*a, under=n) for a, n in found)
    )
    if name == "least_singular_value":  # the leading minors of M M' - floor² 1
        less = enclosed(-(claim["at_least"] ** 2))
        half = [
            [sum(map(Bounds.__mul__, a, b), less if a is b else none) for b in m[:k]]
            for k, a in enumerate(m, 1)
        ]
        gram = [[half[max(i, k)][min(i, k)] for i in range(4)] for k in range(4)]
        (a, b, *_), (_, c, *_), last = *gram[:2], cofactors(*gram[:3])
        parts = [
            a,
            a * c - b * b,
            last[3],
            sum(map(Bounds.__mul__, gram[3], last), none),
        ]
    elif name == "sign_of_R":
        parts = [ratios[0] * (fz if claim["sign"] == "positive" else none - fz)]
    elif name == "hover_thrust":  # the share of the weight is thrust / fz
        least, most = enclosed(claim["at_least"]) * fz, enclosed(claim["at_most"]) * fz
        parts = [
            fz,
            *(part for thrust in thrusts for part in (thrust - least, most - thrust)),
        ]
        parts = parts if fz.value > 0 else [none - part for part in parts]
    else:  # attitude: the determinant is the product of the force and the vertical in body axes
        sine, cosine = sine_and_cosine(enclosed(claim["tilt"]))
        parts = [cosine, fz * fz * cosine * cosine - (fx * fx + fy * fy) * sine * sine]
    return all(
        part.value - part.error > abs(part.slope) + part.spread for part in parts
    )


def parsed(value: Any, form: Any, what: str) -> Any:
    """Return a value of a form, its numbers as fractions; an object comes as a tuple of pairs."""
    found = sorted(name for name, _ in value) if isinstance(value, tuple) else []
    if (
        isinstance(form, dict)
        and found
        and found == sorted({*found, "joints"} & {*form} if form is CLAIMS else form)
    ):
        return {
            name: parsed(dict(value)[name], form[name], name)
            for name in form
            if name in found
        }
    if (
        isinstance(form, list)
        and isinstance(value, list)
        and len(value) in range(*form[1:])
    ):
        return [parsed(one, form[0], what) for one in value]
    if (
        isinstance(form, str)
        and isinstance(value, str)
        and re.fullmatch(RULES.get(form, form), value)
    ):
        return Fraction(value) if form in (NUMBER, POSITIVE) else value
    rule = (
        f"an object with the names {', '.join(form)}, each once"
        if isinstance(form, dict)
        else form
    )
    rule = (
        f"a list of {form[1]} {'or' if form[3:] else 'to'} {form[2] - 1} values"
        if isinstance(form, list)
        else rule
    )
    raise ValueError(f"{what} must be {rule}, got {repr(found or value)[:60]}")


def check(text: str) -> dict[str, Any]:
    """Return of which vehicle what is proved, and the first places where it is not; ValueError if it is none."""
    whole, stated = (
        parsed(json.loads(text, object_pairs_hook=tuple), FORM, "the document"),
        json.loads(text),
    )
    law, pieces, places, lines = (
        whole["law"],
        whole["pieces"],
        {},
        [f"vehicle {json.dumps(stated['vehicle'])}"],
    )
    _, drag, thrust, arm, height, spin = whole["vehicle"].values()
    ratios = (
        enclosed(drag / (thrust * arm) * (1 if spin == "clockwise" else -1)),
        enclosed(height / arm),
    )
    rise = [
        sum(a * comb(j, k) / comb(len(law) - 1, k) for k, a in enumerate(law[: j + 1]))
        for j in range(len(law))
    ]
    curved = any(len(one) > 2 for piece in pieces for one in piece["alpha"])
    if (
        rise[0] != 0
        or rise[-1] != 1
        or rise != sorted(rise)
        or (curved and len(law) > 2)
    ):
        raise ValueError(
            "law must rise from 0 to 1, evenly where pieces are curved, got another polynomial"
        )
    for piece in pieces:
        piece["moved"] = [
            a if curved else [a[0], *(sum(a[1:]) * c for c in law[1:])]
            for a in piece["alpha"]
        ]
    for name, claim in whole["claims"].items():
        missed, _ = [], stated["claims"][name].pop("cover", [])
        for order, most in enumerate(
            [ZERO, *claim.values()] if name == "joints" else []
        ):
            at = [motion(piece, order) * 2 for piece in pieces]
            for k, after in enumerate(at):
                jumps = (
                    abs(sum(a) - b[0]) for a, b in zip(at[k - 1], after, strict=False)
                )
                missed += [f"at the start of piece {k}"] * (max(jumps) > most)
        for k, (piece, breaks) in enumerate(
            zip_longest(pieces, claim["cover"]) if name != "joints" else []
        ):
            if (
                not (piece and breaks)
                or breaks != sorted({*breaks})
                or [breaks[0], breaks[-1]] != [0, 1]
            ):
                raise ValueError(
                    f"cover of {name} must rise from 0 to 1 on piece {k}, got another"
                )
            test = partial(
                proves, name, claim, ratios, motion(piece, ORDERS.get(name, 0))
            )
            missed += [
                f"on piece {k} from {a} to {b}"
                for a, b in pairwise(breaks)
                if not test(a, b)
            ]
        places[name] = missed[0] if missed else ""
        lines.append(
            f"{'NOT ' * bool(missed)}proved: {name} {json.dumps(stated['claims'][name])} {places[name]}".strip()
        )
    proved, values = not any(places.values()), stated["claims"]
    lacking = [
        f"{name} at least {values[name]['at_least']}, below {float(limit):g}"
        if name in values
        else f"no claim of {name}"
        for name, limit in FLYABLE.items()
        if name not in values or Fraction(values[name]["at_least"]) < limit
    ]
    if proved and lacking:
        lines.append(f"not proved flyable: {', '.join(lacking)}")
    return {
        "proved": proved,
        "flyable": proved and not lacking,
        "vehicle": stated["vehicle"],
        "claims": places,
        "values": values,
        "lines": lines,
    }


def value_at(polynomial: list[Fraction], at: Fraction) -> Fraction:
    """Return the value of a polynomial, the lowest power first."""
    value = ZERO
    for coefficient in reversed(polynomial):
        value = value * at + coefficient
    return value


def even_or_own(rows: list[Row], half_unit: Fraction, period: Fraction) -> list[Row]:
    """Return rows at the even times of a period if theirs are these, rounded to units; else the rows as they are."""
    step, first = period / max(len(rows) - 1, 1), rows[0].t
    even = [first + number * step for number in range(len(rows))]
    late = [row.t - t for row, t in zip(rows, even, strict=True)]
    allowed = half_unit * Fraction("1.000001")
    if max(map(abs, late)) > allowed and (
        first == 0 or max(late) - min(late) > Fraction("1.999") * half_unit
    ):  # a first time that is not 0 is rounded too
        return rows
    return [row._replace(t=t) for row, t in zip(rows, even, strict=True)]


def held_against(
    text: str, rows: list[Row], half_unit: Fraction = ZERO
) -> tuple[str, float]:
    """Return the first row of a table that is not on the curve of a certificate at its time, "" if all are.

    Each angle may be off by the certificate's deviation and the row's slack. The first row is at the start of the curve.
    Times that are printed to units of twice `half_unit` [s] may be the even times of the curve's period.
    The second value is how far the middles of straight lines between rows are from the curve at most [rad].
    """
    whole = parsed(json.loads(text, object_pairs_hook=tuple), FORM, "the document")
    pieces, law, allowed = whole["pieces"], whole["law"], whole["deviation"]
    if "rate" not in whole["claims"]:
        raise ValueError(
            "claims must have a rate to compare a table, got none: untimed"
        )
    ends = list(accumulate(piece["duration"] for piece in pieces))
    rows = even_or_own(rows, half_unit, ends[-1])
    first, last, between = rows[0].t, rows[-1].t, ZERO

    def off_curve(t: Fraction, angles: list[Fraction]) -> list[Fraction]:
        k = min(bisect_right(ends, t - first), len(pieces) - 1)
        share = value_at(law, 1 - (ends[k] - (t - first)) / pieces[k]["duration"])
        curve = [value_at(one, share) for one in pieces[k]["alpha"]] * 2
        return [abs(a - b) for a, b in zip(angles, curve, strict=False)]

    for number, row in enumerate(rows, 1):
        if number > 1:
            before = rows[number - 2]
            if row.t <= before.t:
                return f"row {number} is not after the row before it", float(between)
            middle = [
                (a + b) / 2 for a, b in zip(before.angles, row.angles, strict=True)
            ]
            between = max(between, *off_curve((before.t + row.t) / 2, middle))
        for joint, off in enumerate(off_curve(row.t, row.angles)):
            most = allowed + row.slacks[joint]
            if off > most:
                angle = f"alpha{joint + 1} = {float(row.angles[joint]):.9g}"
                place = f"row {number}, t = {float(row.t):.9g} s"
                how = (
                    f"{float(off):.3g} rad off the curve, allowed is {float(most):.3g}"
                )
                return f"{place}: {angle} is {how}", float(between)
    seconds = last - first
    if abs(seconds - ends[-1]) > (ends[-1] + 2) / 10**9:
        what = (
            f"the rows last {float(seconds):.9g} s, the curve {float(ends[-1]):.9g} s"
        )
        return what, float(between)
    return "", float(between)


def rows_of_csv(path: Path) -> tuple[list[Row], Fraction]:
    """Return the rows of a CSV file with the columns t, alpha1 to alpha4 (s, rad), and half a unit of its times.

    Raises ValueError if it is no such file.
    """
    names = ["t", "alpha1", "alpha2", "alpha3", "alpha4"]
    with path.open(encoding="utf-8-sig", newline="") as stream:
        table = csv.DictReader(stream, strict=True)
        if not {*names} <= {*(table.fieldnames or ())}:
            raise ValueError(
                f"columns must be {', '.join(names)} (s, rad), got {table.fieldnames}; gaitgraph verify reads others"
            )
        try:
            numbers = [[Fraction(row[name]) for name in names] for row in table]
        except (csv.Error, TypeError, ValueError, ZeroDivisionError) as error:
            raise ValueError(f"{path.name} must hold numbers: {error}") from None
    if not numbers:
        raise ValueError(f"{path.name} must have rows, got none")
    decimals = next(
        (
            k
            for k in range(60)
            if all((t * 10**k).denominator == 1 for t, *_ in numbers)
        ),
        60,
    )
    rows = [Row(t, angles, [ZERO] * 4) for t, *angles in numbers]
    return rows, Fraction(1, 2 * 10**decimals)


if __name__ == "__main__":
    try:
        if len(sys.argv) not in (2, 3):
            raise ValueError("usage: python check.py gait.cert.json [gait.csv]")
        document = Path(sys.argv[1]).read_text(encoding="utf-8-sig")
        found = check(document)
        off = ""
        lines = [*found["lines"], "no table was compared"]
        if len(sys.argv) == 3:
            off, between = held_against(document, *rows_of_csv(Path(sys.argv[2])))
            lines[-1] = f"NOT on the curve: {off}"
            if not off:
                lines[-1] = (
                    f"each row is on the curve, lines between rows to {between:.2g} rad"
                )
    except (OSError, RecursionError, ValueError) as error:
        print(f"check.py: {error}", file=sys.stderr)
        sys.exit(2)
    print("\n".join(lines))
    sys.exit(int(bool(off) or not found["proved"]))

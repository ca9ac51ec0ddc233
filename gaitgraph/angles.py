"""Angles: reading what people type, arithmetic modulo π, and writing multiples of π.

Inside the package every angle is a float in radians. Only this module reads degrees and texts such as ``"3pi/8"``.
"""

from __future__ import annotations

import math
import re
from numbers import Complex, Number, Real
from typing import Any, SupportsIndex

from gaitgraph.arrays import check_unmasked, first_masked
from gaitgraph.errors import wrong

__all__ = [
    "angle_from_text",
    "angles_from",
    "distance_to_multiple",
    "text_from_angle",
    "wrapped",
]

HALF_PI = math.pi / 2
"""π/2, the end of the range in which tilt angles are represented (rad)."""

_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d+)?"
_ANGLE = re.compile(
    rf"""(?P<sign>[+-]?)\s*(?:
        (?P<plain>{_NUMBER})\s*(?P<unit>deg|°|rad)?
      | (?:(?P<factor>{_NUMBER})\s*\*?\s*)?(?:pi|π)(?:\s*/\s*(?P<divisor>{_NUMBER}))?
    )""",
    re.VERBOSE | re.IGNORECASE | re.ASCII,
)
_LONGEST = 64
_LARGEST = 1e6  # rad, of an angle in an array: a larger one says little about its sine


def __dir__() -> list[str]:
    return [*__all__]


def angle_from_text(value: object, name: str = "angle") -> float:
    """Return the angle [rad] that a number or a text means.

    A text is a number (rad), a multiple of π such as ``"3pi/8"``, ``"-3*pi/8"`` or ``"π/2"``, or degrees such as
    ``"67.5deg"`` or ``"67.5°"``. Raises InputError, with the `name` of the value, if it is no angle or not finite.

    >>> angle_from_text("3pi/8") == 3 * math.pi / 8
    True
    >>> angle_from_text("-67.5deg")
    -1.1780972450961724
    """
    angle = _angle_in_text(value) if isinstance(value, str) else number_of(value)
    if not math.isfinite(angle):
        allowed = "a finite number in radians, or a text such as '3pi/8', '-3*pi/8' or '67.5deg'"
        raise wrong(name, f"must be {allowed}", value)
    return angle


def _angle_in_text(text: str) -> float:
    """Return the angle that a text states [rad], NaN for any other text."""
    if len(text) > _LONGEST:
        return math.nan
    match = _ANGLE.fullmatch(text.strip().replace("−", "-"))
    if match is None:
        return math.nan
    sign, plain, unit, factor, divisor = match.groups()
    if plain:
        angle = float(plain)
        if (unit or "").lower() in ("deg", "°"):
            angle = math.radians(angle)
    else:
        parts = float(divisor or 1)
        if parts == 0:
            return math.nan
        angle = float(factor or 1) * math.pi / parts
    return -angle if sign == "-" else angle


def in_degrees(value: object) -> str:
    """Return the hint for an angle that is too large in radians and would make sense in degrees, else an empty text.

    >>> in_degrees(30.0), in_degrees("3pi/2"), in_degrees(1.6)
    ("; for degrees write '30deg'", '', '')
    """
    text = value.strip() if isinstance(value, str) else f"{number_of(value):g}"
    is_plain = re.fullmatch(rf"[+−-]?{_NUMBER}", text, re.ASCII)
    if is_plain and 2 <= float(text.strip("+−-")) <= 360:
        return f"; for degrees write '{text}deg'"
    return ""


def angle_within(
    value: object, name: str, limit: float = HALF_PI, *, least: float | None = None
) -> float:
    """Return the angle that a number or a text means; InputError unless it is within ±limit, or from `least` to it.

    >>> angle_within("30", "alpha1")
    Traceback (most recent call last):
    gaitgraph.errors.InputError: alpha1 must be within ±π/2 rad, got '30'; for degrees write '30deg'
    """
    angle = angle_from_text(value, name)
    if not (-limit if least is None else least) <= angle <= limit:
        most = text_from_angle(limit)
        if least is None:
            allowed = f"within ±{most} rad"
        else:
            allowed = f"an angle from {least:g} to {most} rad"
        raise wrong(name, f"must be {allowed}", value, in_degrees(value))
    return angle


def angles_from(values: Any, name: str = "angles") -> Any:
    """Return numbers [rad] and texts, in an array or nested lists of any shape, as an array.

    InputError for anything else, and for angles that are not finite or beyond ±1e6 rad.

    >>> angles_from([["pi/2", 0.5]]).round(4).tolist()
    [[1.5708, 0.5]]
    """
    import numpy as np

    check_unmasked(values, name)
    try:
        numbers = np.asarray(values)
        if numbers.dtype.kind in "fiu":
            angles = np.asarray(numbers, dtype=float)
        else:
            given = np.asarray(values, dtype=object)
            read = [angle_from_text(one, name) for one in given.flat]
            angles = np.array(read, dtype=float).reshape(given.shape)
    except ValueError as error:  # of numpy for rows of different lengths
        allowed = (
            "finite numbers in radians, or texts such as '3pi/8', in rows of one length"
        )
        raise wrong(name, f"must be {allowed}", values) from error
    fine = np.abs(angles) <= _LARGEST  # NaN is not
    if not fine.all():
        place = tuple(np.argwhere(~fine)[0].tolist())
        row = place[0] + 1 if angles.ndim == 2 else None
        rule = "must be finite angles within ±1e6 rad"
        raise wrong(name, rule, float(angles[place]), row=row)
    return angles


def number_of(value: object) -> float:
    """Return a real number, Python's or numpy's, as a float, and NaN for anything else (booleans, texts, masked ones).

    >>> number_of(3), number_of(True), number_of("3")
    (3.0, nan, nan)
    """
    if type(value) is float:
        return value
    if getattr(value, "ndim", None) == 0 and hasattr(value, "item"):
        if first_masked(value) is not None:
            return math.nan
        value = value.item()
    # Decimal is a Number that is neither real nor complex.
    real = isinstance(value, Real) or (
        isinstance(value, Number) and not isinstance(value, Complex)
    )
    if isinstance(value, bool) or not real:
        return math.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except (OverflowError, ValueError):  # the second of a signalling NaN
        return math.nan


def is_list(value: object) -> bool:
    """Return whether a value is a list, a tuple or an array of one dimension or more.

    >>> is_list([0.1]), is_list(0.1), is_list("pi")
    (True, False, False)
    """
    import numpy as np

    is_array = isinstance(value, np.ndarray) and value.ndim > 0
    return is_array or isinstance(value, (list, tuple))


def checked_number(
    name: str,
    value: object,
    allowed: str = "a finite number ≥ 0",
    *,
    above: bool = False,
    most: float = math.inf,
) -> float:
    """Return a finite number from 0, which `above` excludes, to `most`, or raise InputError with what is `allowed`.

    >>> checked_number("floor", 0.05)
    0.05
    """
    number = number_of(value)
    if not 0 <= number <= most or math.isinf(number) or (above and number == 0):
        raise wrong(name, f"must be {allowed}", value)
    return number


def checked_floor(floor: object) -> float:
    """Return a floor of the least singular value, dimensionless, from 0 to 1e12, or raise InputError."""
    return checked_number("floor", floor, "a number from 0 to 1e12", most=1e12)


def whole_number(name: str, value: object, low: int, high: int) -> int:
    """Return a whole number, Python's or numpy's, or raise InputError by its name.

    >>> whole_number("count", 3, 1, 9)
    3
    """
    # number_of is NaN for booleans and arrays. A protocol is slow to compare with.
    if (
        not (type(value) is int or isinstance(value, SupportsIndex))
        or math.isnan(number_of(value))
        or not low <= int(value) <= high
    ):
        raise wrong(name, f"must be a whole number from {low} to {high}", value)
    return int(value)


def text_from_angle(angle: float) -> str:
    """Return a short text: a multiple of π/32 when the angle is one (to 1e-9 rad), else four decimals.

    >>> text_from_angle(-3 * math.pi / 8), text_from_angle(0.3), text_from_angle(0.0)
    ('-3π/8', '0.3000', '0')
    >>> [text_from_angle(math.pi / 8 + off) for off in (0.9e-9, 1.1e-9, -1.1e-9)]
    ['π/8', '0.3927', '0.3927']
    """
    angle = angle_from_text(angle)
    whole = round(angle * 32 / math.pi)
    if abs(angle - whole * math.pi / 32) > 1e-9:
        return f"{angle:.4f}"
    if whole == 0:
        return "0"
    divisor = 32 // math.gcd(abs(whole), 32)
    factor = whole * divisor // 32
    return (
        {1: "", -1: "-"}.get(factor, str(factor))
        + "π"
        + (f"/{divisor}" if divisor > 1 else "")
    )


def figure(number: float, digits: int = 3) -> str:
    """Return a number with three significant digits, and with thousands separated, as a person would write it.

    >>> figure(20000.0), figure(5.8905), figure(0.45371), figure(-2.0)
    ('20,000', '5.89', '0.454', '-2')
    """
    return f"{float(f'{number:.{digits}g}'):,.12g}"


def figures_apart(value: float, limit: float, digits: int = 3) -> tuple[str, str]:
    """Return a value and the limit that it breaks with as many significant digits as tell them apart, up to 12.

    >>> figures_apart(60.0004, 60.0), figures_apart(71.23, 60.0), figures_apart(1.00254, 1.0)
    (('60.0004', '60'), ('71.2', '60'), ('1.003', '1'))
    >>> figures_apart(1 + 1e-11, 1.0), figures_apart(1 + 1e-13, 1.0)
    (('1.00000000001', '1'), ('1', '1'))
    """
    while digits < 12 and figure(value, digits) == figure(limit, digits):
        digits += 1
    return figure(value, digits), figure(limit, digits)


def percent(fraction: float) -> str:
    """Return a fraction as a percentage with two decimals, everywhere the same.

    >>> percent(0.85148)
    '85.15 %'
    """
    return f"{100 * fraction:.2f} %"


def wrapped(angle: Any, period: float = math.pi) -> Any:
    """Return angles, of any shape, modulo a period in [−period/2, period/2]; those in that range are unchanged.

    Raises InputError as :func:`angles_from` does.

    >>> wrapped(math.pi / 2) == math.pi / 2, round(wrapped(2.0), 4)
    (True, -1.1416)
    """
    is_period = type(period) is float and 0.0 < period < math.inf
    if type(angle) is float and abs(angle) <= _LARGEST and is_period:
        return angle - period * round(angle / period)
    import numpy as np

    period = checked_number("period", period, "a positive number", above=True)
    angles = angles_from(angle, "angle")
    return angles - period * np.rint(angles / period)


def distance_to_multiple(angle: Any, period: float) -> Any:
    """Return the distance (rad, not negative) from angles, of any shape, to the nearest multiple of a period.

    >>> round(distance_to_multiple(3.0, math.pi), 4)
    0.1416
    """
    return abs(wrapped(angle, period))

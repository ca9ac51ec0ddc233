"""The paper's four gaits: waypoints, color, sign of R and the sixteen vertices as printed (Section 5)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Literal


@dataclass(frozen=True)
class PublishedGait:
    number: int
    color: Literal["red", "blue"]
    sign: Literal["positive", "negative"]
    waypoints: tuple[tuple[str, str], ...]
    angles: tuple[tuple[float, float], ...]
    printed: tuple[tuple[float, float], ...]
    flyable: bool
    reachable: bool


GAITS = (
    PublishedGait(
        number=1, color="blue", sign="negative", flyable=False, reachable=False,
        waypoints=(("5pi/16", "pi/8"), ("5pi/16", "3pi/8"), ("pi/16", "3pi/8"), ("pi/16", "pi/8")),
        angles=((5 * pi / 16, pi / 8), (5 * pi / 16, 3 * pi / 8), (pi / 16, 3 * pi / 8), (pi / 16, pi / 8)),
        printed=((-0.648, -0.727), (-0.648, -1.512), (0.138, -1.512), (0.138, -0.727)),
    ),
    PublishedGait(
        number=2, color="blue", sign="negative", flyable=False, reachable=False,
        waypoints=(("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")),
        angles=((3 * pi / 8, -3 * pi / 8), (3 * pi / 8, -pi / 8), (pi / 8, -pi / 8), (pi / 8, -3 * pi / 8)),
        printed=((-0.844, 0.844), (-0.844, 0.059), (-0.059, 0.059), (-0.059, 0.844)),
    ),
    PublishedGait(
        number=3, color="red", sign="negative", flyable=True, reachable=False,
        waypoints=(("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")),
        angles=((3 * pi / 8, -3 * pi / 8), (3 * pi / 8, -pi / 8), (pi / 8, -pi / 8), (pi / 8, -3 * pi / 8)),
        printed=((1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)),
    ),
    PublishedGait(
        number=4, color="red", sign="positive", flyable=True, reachable=True,
        waypoints=(("-pi/8", "pi/8"), ("-pi/8", "3pi/8"), ("-3pi/8", "3pi/8"), ("-3pi/8", "pi/8")),
        angles=((-pi / 8, pi / 8), (-pi / 8, 3 * pi / 8), (-3 * pi / 8, 3 * pi / 8), (-3 * pi / 8, pi / 8)),
        printed=((-0.393, 0.393), (-0.393, 1.178), (-1.178, 1.178), (-1.178, 0.393)),
    ),
)  # fmt: skip

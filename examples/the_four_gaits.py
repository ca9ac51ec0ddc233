"""The paper's four gaits side by side: all valid, two flyable, one reachable from ordinary hover."""

from math import pi

import gaitgraph as gg

square = [(3 * pi / 8, -3 * pi / 8), (3 * pi / 8, -pi / 8), (pi / 8, -pi / 8), (pi / 8, -3 * pi / 8)]
gaits = {
    "Gait 1": gg.lift(
        [(5 * pi / 16, pi / 8), (5 * pi / 16, 3 * pi / 8), (pi / 16, 3 * pi / 8), (pi / 16, pi / 8)], "blue"
    ),
    "Gait 2": gg.lift(square, "blue"),
    "Gait 3": gg.lift(square, "red"),
    "Gait 4": gg.lift(
        [(-pi / 8, pi / 8), (-pi / 8, 3 * pi / 8), (-3 * pi / 8, 3 * pi / 8), (-3 * pi / 8, pi / 8)], "red"
    ),
}
for name, gait in gaits.items():
    report = gg.validate(gait)
    print(f"{name}: valid {report.valid}, flyable {report.flyable}, from hover {report.reachable_from_hover}")
    print(f"        {report.reason or 'nothing against it'}")

"""Bring a gait of your own: paint a loop, or bring all four angles, and ask what holds."""

import gaitgraph as gg

painted = gg.lift([(0.9, -0.9), (1.1, -0.9), (1.1, -0.5)], ["red", "blue", "blue"])
report = gg.validate(painted)
print(report["two_color"].message)  # which neighbours Figure 15 forbids, and what would help

scaled = gg.lift([(0.9, -0.9), (1.1, -0.9), (1.1, -0.5)], "red").biased(0.8)
report = gg.validate(scaled)
print(report)  # off the surface: where, and by how much

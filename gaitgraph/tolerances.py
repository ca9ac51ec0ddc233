"""Every tolerance that several modules share, by name, with its unit and its reason."""

from __future__ import annotations

import math

SAME_ANGLE = 1e-9
"""Up to this two angles are one, and a point is on a sheet, a row, a grid node, a border or a line [rad].

It is far above rounding, and far below what a servo resolves.
"""

ROUND_OFF = 1e-12
"""What some ten operations on angles, or an overlay of polygons, may add by rounding [rad]."""

ON_PLANE = 1e-14
"""Up to this α3 and α4 are exactly those of the red sheet: some ten units of rounding of one angle [rad]."""

IDLE_SHARE = 1e-9
"""A share of the weight, times |R|, up to which a rotor idles: floats tell it from zero no better."""

DEFAULT_TOLERANCE = 2e-3
"""Up to this |Rφ| and |Rθ| a point is on the surface, and up to this it is on a sheet [rad].

The paper's printed vertices reach 1.4e-3.
"""

DEFAULT_CROSSING_TOLERANCE = math.pi / 32
"""Distance from a crossing line within which a plane type is `?` [rad]: half a step of the paper's grid."""

DEFAULT_FLOOR = 0.05
"""Least singular value, dimensionless, above which the decoupling matrix is far from singular."""

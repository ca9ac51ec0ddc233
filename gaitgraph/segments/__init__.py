"""What holds along a straight segment of tilt angles, not only at its ends.

Segments are pairs of arrays of shape (m, 4) [rad]. Every answer is a bracket of the true least value, or a closed form.
"""

from __future__ import annotations

from gaitgraph.segments.determinants import (
    least_level_determinant,
    level_determinant_curvature,
    range_of_level_determinant,
)
from gaitgraph.segments.residuals import largest_residual
from gaitgraph.segments.search import Bound, Least, Value, least_along, least_of_bent, least_of_each
from gaitgraph.segments.sines import largest_sine
from gaitgraph.segments.singularvalues import (
    keeps_singular_value_above,
    least_singular_value_along,
    least_singular_value_of_all,
    singular_value_bound,
)
from gaitgraph.segments.thrusts import thrust_shares_along, thrusts_push_up, where_thrusts_vanish

__all__ = [
    "Bound",
    "Least",
    "Value",
    "keeps_singular_value_above",
    "largest_residual",
    "largest_sine",
    "least_along",
    "least_level_determinant",
    "least_of_bent",
    "least_of_each",
    "least_singular_value_along",
    "least_singular_value_of_all",
    "level_determinant_curvature",
    "range_of_level_determinant",
    "singular_value_bound",
    "thrust_shares_along",
    "thrusts_push_up",
    "where_thrusts_vanish",
]

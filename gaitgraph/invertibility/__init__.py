"""Is the decoupling matrix invertible? Equations (1) to (6), singular values, tilt margins, bounds along a segment."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.invertibility.coefficients import (
        Coefficients as Coefficients,
        coefficients_of as coefficients_of,
    )
    from gaitgraph.invertibility.geometry import (
        Geometry as Geometry,
        geometry_from_mapping as geometry_from_mapping,
    )
    from gaitgraph.invertibility.matrices import (
        attitude_sensitivities as attitude_sensitivities,
        control_force_matrix as control_force_matrix,
        control_moment_matrix as control_moment_matrix,
        decoupling_matrix as decoupling_matrix,
        determinant as determinant,
        hover_power as hover_power,
        hover_thrust_shares as hover_thrust_shares,
        least_singular_value as least_singular_value,
        level_determinant as level_determinant,
        pitch_sensitivity as pitch_sensitivity,
        roll_sensitivity as roll_sensitivity,
        zero_moment_direction as zero_moment_direction,
    )
    from gaitgraph.invertibility.tilt_margins import (
        least_singular_value_within as least_singular_value_within,
        nearest_singular_attitude as nearest_singular_attitude,
        tilt_margin as tilt_margin,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.invertibility.coefficients": [
                "Coefficients",
                "coefficients_of",
            ],
            "gaitgraph.invertibility.geometry": ["Geometry", "geometry_from_mapping"],
            "gaitgraph.invertibility.matrices": [
                "attitude_sensitivities",
                "control_force_matrix",
                "control_moment_matrix",
                "decoupling_matrix",
                "determinant",
                "hover_power",
                "hover_thrust_shares",
                "least_singular_value",
                "level_determinant",
                "pitch_sensitivity",
                "roll_sensitivity",
                "zero_moment_direction",
            ],
            "gaitgraph.invertibility.tilt_margins": [
                "least_singular_value_within",
                "nearest_singular_attitude",
                "tilt_margin",
            ],
        },
    )

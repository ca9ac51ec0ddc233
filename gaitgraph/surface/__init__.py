"""The gait surfaces: sheets, roots, plane types, the Figure 15 rule, colourings, regions of the (α1, α2) plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.surface.admissible import admissible_region as admissible_region
    from gaitgraph.surface.curved import (
        CurvedSheet as CurvedSheet,
        curved_sheet as curved_sheet,
    )
    from gaitgraph.surface.flight_regions import (
        hover_region as hover_region,
        singular_value_region as singular_value_region,
        thrust_region as thrust_region,
    )
    from gaitgraph.surface.loop_colorings import (
        Coloring as Coloring,
        ColoringRefusal as ColoringRefusal,
        Colorings as Colorings,
        colorings as colorings,
    )
    from gaitgraph.surface.red_components import red_label as red_label
    from gaitgraph.surface.region import (
        Condition as Condition,
        Region as Region,
        Zones as Zones,
        zones_region as zones_region,
    )
    from gaitgraph.surface.servo_regions import (
        servo_margin_region as servo_margin_region,
    )
    from gaitgraph.surface.sheets import (
        root_arrays as root_arrays,
        roots as roots,
        sheet_angles as sheet_angles,
        sheet_distances as sheet_distances,
        types_may_be_adjacent as types_may_be_adjacent,
    )
    from gaitgraph.surface.sign_regions import sign_region as sign_region
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.surface.admissible": ["admissible_region"],
            "gaitgraph.surface.flight_regions": [
                "hover_region",
                "singular_value_region",
                "thrust_region",
            ],
            "gaitgraph.surface.servo_regions": ["servo_margin_region"],
            "gaitgraph.surface.sign_regions": ["sign_region"],
            "gaitgraph.surface.curved": ["CurvedSheet", "curved_sheet"],
            "gaitgraph.surface.loop_colorings": [
                "Coloring",
                "ColoringRefusal",
                "Colorings",
                "colorings",
            ],
            "gaitgraph.surface.red_components": ["red_label"],
            "gaitgraph.surface.region": [
                "Condition",
                "Region",
                "Zones",
                "zones_region",
            ],
            "gaitgraph.surface.sheets": [
                "sheet_distances",
                "root_arrays",
                "roots",
                "sheet_angles",
                "types_may_be_adjacent",
            ],
        },
    )

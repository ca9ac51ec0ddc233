"""Files: reading and writing gait tables in every format, and maps from tilt angles to servos."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.io.columns import table_from_frame as table_from_frame
    from gaitgraph.io.exporting import Exported as Exported, export as export
    from gaitgraph.io.formats import (
        read_table as read_table,
        write_tables as write_tables,
    )
    from gaitgraph.io.servo_map import (
        Joint as Joint,
        ServoMap as ServoMap,
        mapped_table as mapped_table,
        servo_map_from_mapping as servo_map_from_mapping,
        servo_map_named as servo_map_named,
        tilts_from_joints as tilts_from_joints,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.io.columns": ["table_from_frame"],
            "gaitgraph.io.exporting": ["Exported", "export"],
            "gaitgraph.io.formats": ["read_table", "write_tables"],
            "gaitgraph.io.servo_map": [
                "Joint",
                "ServoMap",
                "mapped_table",
                "servo_map_from_mapping",
                "servo_map_named",
                "tilts_from_joints",
            ],
        },
    )

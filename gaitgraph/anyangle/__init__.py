"""Any-angle loops: the shortest closed loops through ordered waypoints, not on a grid.

On a sheet a straight line in (α1, α2) is straight in all four angles, and the admissible region is a plane figure with
known borders. So a shortest loop is straight wherever it can be and bends only at corners of that figure. Straight
borders, those of the user's polygons among them, are exact. A curved one is replaced by a polygon that keeps inside it
by at most the stated accuracy; a second polygon outside it bounds the length from below.

If the straight loop through the waypoints holds along its whole length it is the shortest, and no figure is needed.
Red and blue meet in isolated points, and only there does a loop change its color.
"""

from __future__ import annotations

from gaitgraph.anyangle.loops import any_angle_candidates, with_nearest
from gaitgraph.anyangle.meetings import meeting_points
from gaitgraph.anyangle.prepared import PreparedRegion, prepared_region, region_of
from gaitgraph.anyangle.straight import straight_loop_holds

__all__ = [
    "PreparedRegion",
    "any_angle_candidates",
    "meeting_points",
    "prepared_region",
    "region_of",
    "straight_loop_holds",
    "with_nearest",
]

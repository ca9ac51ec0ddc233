"""A table of columns that are there as a whole, whoever made them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError
from gaitgraph.gait.table import Table
from gaitgraph.io.header import Header, joints_of, rows_of
from gaitgraph.io.values import check_times

if TYPE_CHECKING:
    from gaitgraph.io.servo_map import ServoMap

__all__ = ["checked_table", "table_from_columns"]


def table_from_columns(
    columns: list[tuple[str, Any]], about: dict[str, Any] | None = None, *, plane_only: bool = False
) -> Table:
    """Return a table of columns that somebody else made, checked and in order.

    Parameters
    ----------
    columns
        Names, each with an array or a list of values; angles in radians may be texts. Others than those of a gait table
        are passed over.
    about
        What made them.
    plane_only
        Whether alpha1 and alpha2 are enough.

    Raises
    ------
    InputError
        If a column is missing, or a value is not allowed.

    Examples
    --------
    >>> table_from_columns([("alpha2", ["-pi/8"]), ("alpha1", [0.5]), ("color", ["red"])]).columns["alpha2"].round(4)
    array([-0.3927])
    """
    made, joints = joints_of(about or {}, None)
    return checked_table(columns, made, plane_only, joints)


def checked_table(
    columns: list[tuple[str, Any]], about: dict[str, Any], plane_only: bool, joints: ServoMap | None = None
) -> Table:
    """Check columns and bring them into order."""
    header = Header([name for name, _ in columns], plane_only, joints)
    if not rows_of(columns):
        raise InputError("it has no rows; allowed is at least one")
    found = header.columns([values for _, values in columns], 0, angle_texts=True)
    if "t" in found:
        check_times(found["t"], -math.inf, len(found["t"]))
    return Table(columns=found, about=about)

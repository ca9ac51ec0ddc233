"""The gait table of a timed gait, whole or as consecutive pieces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gaitgraph.gait.table import ROWS_OF_A_PIECE, Table, merged
from gaitgraph.timing.timed_gait import LAWS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from gaitgraph.timing.timed_gait import TimedGait


def table_of(timed: TimedGait, about: Mapping[str, Any] | None = None) -> Table:
    """Return the table of a timed gait, and what made it.

    >>> from gaitgraph.gait.gait import lift
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=4))
    >>> len(table), list(table.columns)[:6]
    (5, ['t', 'alpha1', 'alpha2', 'alpha3', 'alpha4', 'color'])
    """
    return merged(pieces_of(timed, about))


def pieces_of(
    timed: TimedGait, about: Mapping[str, Any] | None = None, *, rows: int = ROWS_OF_A_PIECE
) -> Iterator[Table]:
    """Yield the table of a timed gait as consecutive pieces, so that any length fits in memory.

    Parameters
    ----------
    timed
        The gait.
    about
        What else the table states about its making.
    rows
        Rows of a piece, at least 2; the last piece may have one more.
    """
    gait = timed.gait
    made: dict[str, Any] = {
        "vehicle": gait.vehicle.as_mapping(),
        "coefficients": gait.coefficients.kind,
        "crossing_tolerance": gait.crossing_tolerance,
        "period": timed.period,
        "law": timed.law,
    }
    by_law = timed.law in LAWS
    if not by_law:
        made["made_by"] = "pace"
    if gait.request:
        # A request can ask for the timing of a law, and for no other.
        timing = {"period": timed.period, "law": timed.law, "samples": timed.samples} if by_law else {}
        made["request"] = {**gait.request, **timing}
    made |= about or {}
    end = timed.samples + 1
    # No piece is one row alone: numpy rounds the product of a single row in another way.
    for start in range(0, end - 1, rows):
        stop = end if end - (start + rows) <= 1 else start + rows
        yield Table(columns=timed.columns(range(start, stop)), about=made)

"""What retargeting answers: the new rows, how far each given one was moved, and the verdicts before and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import Infeasible
from gaitgraph.io.reading import gait_of
from gaitgraph.validation.report import Report, verdict_line

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.table import Table

__all__ = ["Retargeted"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Retargeted:
    """The answer to :func:`retarget`: the nearest flyable gait, or why there is none. Truthy when there is one.

    Parameters
    ----------
    before
        The report of what was given.
    reason
        Why there is no gait, or why it is not flyable; None if it is.
    table
        The new rows, with times if there were any; or None.
    rows
        The number, counted from 0, of the new row that each given row became, shape (n,).
    moved
        How far each given row was moved, in all four angles [rad], shape (n,).
    plane_moved
        By how much in (α1, α2) from the given row's projection onto the red sheet [rad], shape (n,); what is left of
        `moved` is that projection.
    after
        The report of the new gait; or None.
    alternatives
        The summed distance to each component of the flyable region, the chosen one first [rad].
    warnings
        What deserves attention.
    """

    before: Report
    reason: str | None
    table: Table | None = None
    rows: npt.NDArray[np.int64] | None = None
    moved: FloatArray | None = None
    plane_moved: FloatArray | None = None
    after: Report | None = None
    alternatives: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("rows", "moved", "plane_moved"):
            value = getattr(self, name)
            if value is not None:
                array = np.array(value)
                array.flags.writeable = False
                object.__setattr__(self, name, array)

    @property
    def status(self) -> Literal["unchanged", "retargeted", "infeasible"]:
        """Whether the gait is "unchanged" or "retargeted", or there is none: "infeasible"."""
        if self.table is None:
            return "infeasible"
        return "retargeted" if self.added or np.any(self._moves() > 0) else "unchanged"

    def __bool__(self) -> bool:
        return self.table is not None

    def _moves(self) -> FloatArray:
        if self.moved is None:
            raise Infeasible(self.reason)
        return self.moved

    @property
    def gait(self) -> Gait:
        """The new gait as a closed polyline, straight runs merged; Infeasible if there is none."""
        if self.table is None:
            raise Infeasible(self.reason)
        return gait_of(self.table)

    @property
    def total(self) -> float:
        """The sum of all rows' distances [rad]; no flyable gait in the same component has a smaller one."""
        return float(self._moves().sum())

    @property
    def rms(self) -> float:
        """The root mean square of the rows' distances [rad]."""
        return float(np.sqrt(np.mean(self._moves() ** 2)))

    @property
    def largest(self) -> tuple[float, int]:
        """The largest distance [rad], and its row, counted from 1."""
        row = int(np.argmax(self._moves()))
        return float(self._moves()[row]), row + 1

    @property
    def unchanged(self) -> int:
        """How many rows stayed as they were, bit by bit."""
        return int(np.sum(self._moves() == 0))

    @property
    def added(self) -> int:
        """How many rows were added between the given ones."""
        if self.table is None or self.rows is None:
            return 0
        return len(self.table) - len(self.rows)

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON; a saved one can be read as a gait file."""
        there = self.table is not None
        verdict = self.after.as_mapping() if self.after is not None else {}
        colors = list(self.table["color"]) if self.table is not None else []
        return {
            "status": self.status,
            "reason": self.reason,
            "rows": len(self._moves()) if there else None,
            "unchanged": self.unchanged if there else None,
            "added": self.added if there else None,
            "total": self.total if there else None,
            "rms": self.rms if there else None,
            "largest": self.largest[0] if there else None,
            "largest_row": self.largest[1] if there else None,
            "moved": self._moves().tolist() if there else [],
            "new_rows": [] if self.rows is None else (self.rows + 1).tolist(),
            "path": [] if self.table is None else self.table.alpha.tolist(),
            "colors": colors,
            "t": self.table["t"].tolist() if self.table is not None and "t" in self.table else None,
            "alternatives": list(self.alternatives),
            "before": self.before.as_mapping(),
            "valid": verdict.get("valid", False),
            "flyable": verdict.get("flyable", False),
            "reachable_from_hover": verdict.get("reachable_from_hover", False),
            "checks": verdict.get("checks", []),
            "warnings": [*self.warnings, *verdict.get("warnings", [])],
        }

    def __repr__(self) -> str:
        moves = (
            f", {len(self.table)} rows, moved by {self.largest[0]:.4f} rad at most" if self.table is not None else ""
        )
        return f"<Retargeted: {self.status}{moves}>"

    def __str__(self) -> str:
        before = verdict_line(self.before.valid, self.before.flyable, self.before.reachable_from_hover)
        if self.after is None:
            return f"no gait: {self.reason}\nbefore: {before}"
        lines = [f"{self.status}: {self.unchanged} of {len(self._moves())} rows as they were, {self.added} added"]
        if self.status == "retargeted":
            far, row = self.largest
            lines.append(
                f"moved by {far:.4f} rad at most (row {row}), {self.rms:.4f} rad rms, {self.total:.4f} rad in sum"
            )
        lines.append(f"before: {before}")
        if not self.before.flyable:
            lines.append(f"        {self.before.reason}")
        after = verdict_line(self.after.valid, self.after.flyable, self.after.reachable_from_hover)
        lines.append(f"after:  {after}")
        if self.reason:
            lines.append(f"        {self.reason}")
        return "\n".join([*lines, *(f"warning: {warning}" for warning in self.warnings)])

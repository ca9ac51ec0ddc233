"""The gaits of a study: those of the paper, requests that are planned for each vehicle, and files."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import GaitgraphError, Infeasible, InputError, did_you_mean, shown
from gaitgraph.gait.paper_gaits import PAPER_GAITS, paper_gait
from gaitgraph.gait.table import Table
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.io.reading import gait_of, read_table
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import REQUEST_FIELDS, holds_request, read_request, request_from_mapping
from gaitgraph.timing.timed_gait import LAWS

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from gaitgraph.gait.gait import Gait
    from gaitgraph.vehicle import Vehicle

__all__ = ["GaitSource", "sources_of"]

MOST_CORNERS = 10_000
_OF_THE_STUDY = ("vehicle", "period")
_PAPER = re.compile(r"gait([1-4])")


@dataclass(frozen=True, slots=True, kw_only=True)
class GaitSource:
    """One entry of a study's gaits: what makes the gait for a vehicle.

    Parameters
    ----------
    name
        What rows call it.
    kind
        "paper", a gait of the paper by `number`; "request", planned for each vehicle; or "corners", of a file.
    content
        The number, the fields of the request, or the columns; plain values.
    law
        How time is spent along it; one of :data:`gaitgraph.timing.timed_gait.LAWS`.
    """

    name: str
    kind: str
    content: Mapping[str, Any]
    law: str = LAWS[0]

    def gait(self, vehicle: Vehicle) -> Gait:
        """Return the gait for a vehicle.

        Raises
        ------
        Infeasible
            If there is none; the message is the plan's reason.
        InputError
            If the vehicle and what is asked for do not go together.
        """
        if self.kind == "paper":
            return paper_gait(self.content["number"], vehicle, coefficients_of(vehicle))
        if self.kind == "request":
            answer = plan(request_from_mapping({**self.content, "law": self.law, "vehicle": vehicle})[0])
            if answer.loop is None:
                raise Infeasible(answer.reason)
            return answer.gait
        columns = {name: tuple(values) for name, values in self.content.items()}
        return gait_of(Table(columns=_arrays(columns)), vehicle=vehicle)

    def as_mapping(self) -> dict[str, Any]:
        """Return the entry as plain values, read back by :func:`sources_of`."""
        return {"name": self.name, "kind": self.kind, "content": dict(self.content), "law": self.law}


def _arrays(columns: dict[str, Any]) -> dict[str, Any]:
    import numpy as np

    return {name: values if name == "color" else np.array(values, dtype=float) for name, values in columns.items()}


def sources_of(content: Any, folder: Path) -> tuple[GaitSource, ...]:
    """Return the gaits that a study's entry describes.

    Parameters
    ----------
    content
        A list of "gait1" to "gait4", of gait and request files (relative to `folder`), and of tables with the fields of
        a request, `name` beside them.
    folder
        Where the study is.

    Raises
    ------
    InputError, FileProblem
        If an entry is none of those, or two have one name.
    """
    if not isinstance(content, list) or not content:
        raise InputError(f"gaits: {shown(content)}; allowed is a list of gait1 to gait4, files and tables, not empty")
    sources = tuple(_source_of(entry, k, folder) for k, entry in enumerate(content, start=1))
    seen: set[str] = set()
    for source in sources:
        if source.name in seen:
            raise InputError(f"gaits: two are called {shown(source.name)}; allowed are names that differ (name = …)")
        seen.add(source.name)
    return sources


def _source_of(entry: Any, number: int, folder: Path) -> GaitSource:
    told = f"gait {number}"
    if isinstance(entry, str):
        return _named(entry, told, folder)
    if not isinstance(entry, dict):
        raise InputError(f"{told}: {shown(entry)}; allowed is gait1 to gait4, a file, or a table of a request")
    if set(entry) == {"name", "kind", "content", "law"}:  # what as_mapping told
        return GaitSource(**entry)
    fields = dict(entry)
    name = fields.pop("name", told)
    if not isinstance(name, str) or not name or not name.isprintable():
        raise InputError(f"{told} name: {shown(name)}; allowed is a printable text that is not empty")
    if "file" in fields:
        file = fields.pop("file")
        if fields or not isinstance(file, str):
            beside = next(iter(fields), "file")
            raise InputError(f"{told} {beside}: {shown(entry[beside])}; allowed is a file's name, and beside it a name")
        found = _named(file, told, folder)
        return GaitSource(name=name, kind=found.kind, content=found.content, law=found.law)
    known = [one for one in REQUEST_FIELDS if one not in _OF_THE_STUDY]
    for one, value in fields.items():
        if one in _OF_THE_STUDY:
            raise InputError(f"{told} {one}: {shown(value)}; allowed is in the study's {one}s")
        if one not in known:
            hint = did_you_mean(one, [*known, "name", "file"])
            raise InputError(f"{told} {one}: no field of a request{hint or '; allowed are ' + ', '.join(known)}")
    return _requested(fields, name, told)


def _requested(fields: dict[str, Any], name: str, told: str) -> GaitSource:
    """Return the source of a request, checked for the paper's vehicle."""
    law = fields.pop("law", LAWS[0])
    try:
        request = request_from_mapping({**fields, "law": law})[0]
    except InputError as error:
        raise type(error)(f"{told}: {error}") from error
    plain = request.as_mapping()
    content = {one: plain[one] for one in fields}
    content["waypoints"] = [list(point) for point in request.waypoints]
    return GaitSource(name=name, kind="request", content=content, law=law)


def _named(name: str, told: str, folder: Path) -> GaitSource:
    match = _PAPER.fullmatch(name)
    if match:
        return GaitSource(name=name, kind="paper", content={"number": int(match[1])})
    path = folder / name
    if not path.suffix:
        known = [f"gait{number}" for number in PAPER_GAITS]
        hint = did_you_mean(name, known)
        raise InputError(f"{told}: {shown(name)}; allowed are {', '.join(known)}, or the name of a file{hint}")
    try:
        if holds_request(path):
            request, _ = read_request(path, {})
            # The vehicle, its coefficients and the period are the study's.
            plain = {one: value for one, value in request.as_mapping().items() if one not in _OF_THE_STUDY}
            law = plain.pop("law")
            plain.pop("coefficients")
            return GaitSource(name=path.stem, kind="request", content=plain, law=law)
        return GaitSource(name=path.stem, kind="corners", content=_corners_of(path))
    except GaitgraphError as error:
        raise type(error)(f"{told}: {error}") from error


def _corners_of(path: Path) -> dict[str, Any]:
    """Return the corners of a gait in a file, or its rows of alpha1, alpha2 and color, as plain columns."""
    table = read_table(path)
    if "alpha3" in table:
        gait = gait_of(table)
        columns: dict[str, Any] = {f"alpha{k + 1}": gait.alpha[:, k].tolist() for k in range(4)}
        colors: tuple[str, ...] = gait.colors
    else:
        columns = {name: table[name].tolist() for name in ("alpha1", "alpha2")}
        colors = tuple(table["color"])
    count = len(columns["alpha1"])
    if count > MOST_CORNERS:
        raise InputError(f"gait file {str(path)!r}: {count} corners; allowed in a study are {MOST_CORNERS} at most")
    return {**columns, "color": list(colors)} if colors else columns

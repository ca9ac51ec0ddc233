"""One case: its gait is planned and checked, put on a clock, and flown; what came of it is a row.

A case that cannot be planned, is refused, does not settle or fails is a row too, with its reason. Rows hold nothing of
the clock, the machine or the process: the same case is the same row.
"""

from __future__ import annotations

import math
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from gaitgraph import __version__
from gaitgraph.angles import number_of
from gaitgraph.errors import GaitgraphError, Infeasible, InputError, needs_extra
from gaitgraph.flight.simulation import fly
from gaitgraph.study.designs import Case, Study, study_from_mapping
from gaitgraph.study.fleets import columns_of_constant
from gaitgraph.timing.timed_gait import parametrize

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from gaitgraph.gait.gait import Gait

__all__ = ["OUTCOMES", "columns_of", "flown_batch", "known_of", "lost_row", "row_of", "versions"]

OUTCOMES = ("settled", "not settled", "refused", "no gait", "failed")
"""What may come of a case: it flew and settled, or not; it was not flown; there is nothing to fly; it could not be run
to its end."""

Column = tuple[str, str, str]

_HEAD: tuple[Column, ...] = (("case", "whole", ""), ("vehicle", "text", ""), ("drag_ratio", "number", "1"))
_MIDDLE: tuple[Column, ...] = (
    ("gait", "text", ""),
    ("eta", "number", "1"),
    ("period", "number", "s"),
    ("roll", "number", "rad"),
    ("pitch", "number", "rad"),
    ("outcome", "text", ""),
    ("reason", "text", ""),
    ("valid", "flag", ""),
    ("flyable", "flag", ""),
    ("reachable_from_hover", "flag", ""),
    ("gait_singular_value", "number", "1"),
    ("gait_tilt_rate", "number", "rad/s"),
)
_FLOWN: tuple[Column, ...] = (
    ("duration", "number", "s"),
    ("settling_time", "number", "s"),
    ("peak_tilt", "number", "rad"),
    ("peak_thrust", "number", "N"),
    ("peak_thrust_share", "number", "1"),
    ("least_singular_value", "number", "1"),
    ("saturated_fraction", "number", "1"),
    ("energy", "number", "J"),
    ("final_roll", "number", "rad"),
    ("final_pitch", "number", "rad"),
    ("drift", "number", "m"),
    ("tracking_error", "number", "m"),
)
_UNITS_OF_CONSTANTS = {
    "mass": "kg", "gravity": "m/s^2", "arm_length": "m", "thrust_coefficient": "N s^2/rad^2",
    "drag_coefficient": "N m s^2/rad^2", "drag_to_thrust": "m", "inertia": "kg m^2", "first_arm_angle": "rad",
    "max_tilt": "rad", "max_tilt_rate": "rad/s", "max_tilt_acceleration": "rad/s^2", "max_tilt_jerk": "rad/s^3",
    "max_thrust": "N", "servo_lag": "s",
}  # fmt: skip
_LONGEST_REASON = 500


def columns_of(study: Study) -> tuple[Column, ...]:
    """Return the columns of a study's rows, each with its kind (whole, number, text, flag) and unit.

    A constant that varies in any of the vehicles has its column, empty for the others.
    """
    varied: dict[str, Column] = {}
    for model in study.models:
        for name in model.varied:
            if name != "drag_ratio":
                kind = "text" if name == "first_rotor_spin" else "number"
                for column in columns_of_constant(name):
                    varied[column] = (column, kind, _UNITS_OF_CONSTANTS.get(name, ""))
    return (*_HEAD, *varied.values(), *_MIDDLE, *_FLOWN)


def versions() -> dict[str, str]:
    """Return the versions of what rows depend on.

    Raises
    ------
    MissingExtra
        If the engine is not installed.
    """
    try:
        engine = version("mujoco")
    except PackageNotFoundError as error:
        raise needs_extra("mujoco", "a study", "study") from error
    return {"gaitgraph": __version__, "mujoco": engine}


def flown_batch(text: str, numbers: Iterable[int], expected: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return the rows of some cases; what every worker runs.

    Parameters
    ----------
    text
        The study, as :attr:`gaitgraph.study.designs.Study.text` tells it.
    numbers
        Of the cases.
    expected
        The versions that rows are to be made with.

    Raises
    ------
    InputError
        If the versions here are others, or the study is none.
    """
    import json

    here = versions()
    for name, wanted in expected.items():
        if here.get(name) != wanted:
            raise InputError(f"{name}: a worker has {here.get(name)!r}; allowed is {wanted!r}, with which this began")
    study = study_from_mapping(json.loads(text))
    gaits: dict[str, Gait | GaitgraphError] = {}
    return [row_of(study.case(number), study, gaits) for number in numbers]


def row_of(case: Case, study: Study, gaits: dict[str, Gait | GaitgraphError] | None = None) -> dict[str, Any]:
    """Return the row of a case; never raises for what is the case's own.

    Parameters
    ----------
    case, study
        The case, and what it is of.
    gaits
        Gaits that were planned before, by vehicle and source; what is planned here is added.
    """
    row = known_of(case)
    try:
        _plan_and_fly(row, case, study, {} if gaits is None else gaits)
    except Infeasible as error:
        row |= {"outcome": "no gait", "reason": _line(error)}
    except GaitgraphError as error:
        row |= {"outcome": "failed", "reason": _line(error)}
    except Exception as error:  # whatever it is, the study goes on and the row tells it
        row |= {"outcome": "failed", "reason": f"{type(error).__name__}: {_line(error)}"}
    return row


def lost_row(case: Case, reason: str) -> dict[str, Any]:
    """Return the row of a case that cannot be run to its end: whatever process tries dies."""
    return known_of(case) | {"outcome": "failed", "reason": reason}


def known_of(case: Case) -> dict[str, Any]:
    """Return what is known of a case before it is run."""
    row: dict[str, Any] = {"case": case.number, "vehicle": case.model.name}
    for name, value in case.varied.items():
        columns = columns_of_constant(name)
        row |= dict(zip(columns, value if len(columns) > 1 else (value,), strict=True))
    row |= {"gait": case.source.name, "eta": case.eta, "period": case.period, "roll": case.roll, "pitch": case.pitch}
    return row


def _plan_and_fly(row: dict[str, Any], case: Case, study: Study, gaits: dict[str, Gait | GaitgraphError]) -> None:
    vehicle = case.vehicle
    row["drag_ratio"] = vehicle.drag_ratio
    key = repr((case.model.name, case.varied, case.source.name))
    if key not in gaits:
        try:
            gaits[key] = case.source.gait(vehicle)
        except GaitgraphError as error:
            gaits[key] = error
    found = gaits[key]
    if isinstance(found, GaitgraphError):
        raise found
    timed = parametrize(found if case.eta == 1 else found.biased(case.eta), case.period, law=case.source.law)
    report = timed.check()
    row |= {
        "valid": report.valid,
        "flyable": report.flyable,
        "reachable_from_hover": report.reachable_from_hover,
        "gait_singular_value": report["least_singular_value"].value,
        "gait_tilt_rate": report["tilt_rate"].value,
    }
    flight = fly(timed, attitude=(case.roll, case.pitch), settings=study.flight, anyway=study.anyway)
    told = flight.as_mapping()
    row |= {name: _finite(told[name]) for name, _, _ in _FLOWN}
    row["outcome"] = "refused" if flight.refused else "settled" if flight.settled else "not settled"
    row["reason"] = _line(flight.reason)


def _finite(value: Any) -> float | None:
    number = number_of(value)
    return number if math.isfinite(number) else None


def _line(told: object) -> str:
    text = " ".join(str(told).split())
    return text if len(text) <= _LONGEST_REASON else text[:_LONGEST_REASON] + "…"

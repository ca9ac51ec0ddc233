"""The command validate: check a gait file by every rule."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import PAPER_GAITS, Working, command, option, print_problem, show, wants_json
from gaitgraph.errors import InputError


def _vehicle(_: Any, __: Any, name: str | None) -> Any:
    from gaitgraph.flight.vehicle_files import vehicle_or_geometry

    return None if name is None else vehicle_or_geometry(name, lambda note: print_problem(f"warning: {note}"))


@command(
    "Check a gait file: every rule, with value, limit and place.",
    "gait_file require",
    option("--tolerance", "X", "Largest |Rφ|, |Rθ| on the surface.  [default: 0.002]"),
    "floor angle_rounding crossing_tolerance",
    option("--vehicle", "NAME_OR_FILE", "A preset, a TOML file, or a file that describes rotors.", callback=_vehicle),
    "coefficients json",
)
def validate_command(gait_file: str, require: str = "valid", **given: Any) -> int:
    """Check a gait file of any format, the gait of a request, or gait1 to gait4, along its whole length.

    Rows need alpha1 to alpha4, or alpha1, alpha2 and color; the last row is joined with the first.
    The exit code is 1 if the gait is not valid (or not flyable, with --require flyable). CSV and Parquet files of any
    length are read piece by piece.

    If --vehicle describes rotors of any geometry (TOML with [[rotor]], PX4 parameters, URDF or MJCF), physics alone is
    checked, on alpha1 to alphaN, and the exit code is 1 if the table is not flyable.
    """
    from gaitgraph.io.formats import holds_request, read_pieces
    from gaitgraph.validation.validating import validate, validate_geometry
    from gaitgraph.vehicle import Vehicle

    with Working(f"judging {gait_file}"):
        if not isinstance(given.get("vehicle"), Vehicle | None):
            geometry, floor = given.pop("vehicle"), {"floor": given.pop("floor")} if "floor" in given else {}
            for name, value in given.items():
                which = f"--{name.replace('_', '-')}"
                raise InputError(f"{which} must be omitted for rotors of any geometry, got {value!r}")
            return show(validate_geometry(gait_file, geometry, **floor))
        report = validate(gait_file, **given)
    states_none = not (wants_json() or "vehicle" in given or gait_file in PAPER_GAITS or holds_request(gait_file))
    if states_none and "vehicle" not in next(read_pieces(gait_file)).about:
        print_problem("warning: the file states no vehicle: the paper's is taken; --vehicle names another")
    return show(report, ok=report.flyable if require == "flyable" else report.valid)

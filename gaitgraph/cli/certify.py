"""The command certify: prove what holds along a gait, and write the proof."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gaitgraph.cli import Working, command, flag, option, show
from gaitgraph.errors import InputError


@command(
    "Prove what holds along a flyable gait, and write the proof as a certificate.",
    "gait_file",
    option("--output", "FILE", "Write the certificate, a JSON document."),
    option("--tilt", "ANGLE", "Claim too that no attitude within this tilt from upright is singular."),
    flag("--untimed", "Leave rates and accelerations out."),
    "floor force vehicle coefficients json",
)
def certify_command(
    gait_file: str, output: str | None = None, force: bool = False, untimed: bool = False, **given: Any
) -> int:
    """Certify a gait file of any format, the gait of a request, or gait1 to gait4.

    The certificate holds the curve as exact polynomials, the claims, and what proves each; gaitgraph verify checks it,
    and so does the file gaitgraph/certificates/check.py by itself. The exit code is 1 if a claim cannot be proved.
    """
    from gaitgraph.certificates.making import certify, check_certificate
    from gaitgraph.files import check_new_files, target_of

    outputs = [] if output is None else [output]
    for name in outputs:
        check_certificate(name)
        if target_of(Path(name)) == target_of(Path(gait_file)):
            raise InputError(f"--output must be another file than the gait, got {name!r}")
    check_new_files(outputs, force=force)
    with Working(f"certifying {gait_file}"):
        found = certify(gait_file, timing=not untimed, **given)
        for name in outputs:
            found.write(name, force=force)
    return show(found, more={"outputs": outputs}, lines=[f"wrote {name}" for name in outputs])

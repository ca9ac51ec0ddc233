"""The commands certify and verify: what proves a gait, and the check of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import (
    Angle,
    common_options,
    force_option,
    gait_file_argument,
    json_option,
)
from gaitgraph.cli.output import show, working

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen


@click.command(
    "certify",
    short_help="Prove what holds along a flyable gait, and write a certificate.",
)
@gait_file_argument
@click.option(
    "--output", type=click.Path(), help="Write the certificate, a JSON document."
)
@click.option(
    "--tilt",
    type=Angle(),
    help="Also claim that no attitude within this tilt from upright is singular.",
)
@click.option(
    "--untimed", is_flag=True, help="Claim nothing about rates and accelerations."
)
@force_option
@common_options
def certify_command(
    gait_file: str,
    output: str | None,
    tilt: float | None,
    untimed: bool,
    force: bool,
    chosen: Chosen,
) -> int:
    """Certify a gait file of any format, the gait of a request, or gait1 to gait4.

    The certificate holds the curve as exact polynomials, the claims, and what proves each; gaitgraph verify checks it,
    and so does the file gaitgraph/certificates/check.py by itself. The exit code is 1 if a claim cannot be proved.
    """
    from gaitgraph.certificates.making import certify, check_certificate
    from gaitgraph.files import check_new_files, target_of

    outputs = []
    if output is not None:
        check_certificate(output)
        outputs = [output]
        if target_of(Path(output)) == target_of(Path(gait_file)):
            raise click.UsageError(
                f"--output must be another file than the gait, got {output!r}"
            )
    check_new_files(outputs, force=force)
    with working(f"certifying {gait_file}"):
        certified = certify(
            gait_in(gait_file, **chosen),
            **chosen,
            tilt=tilt,
            timing=not untimed,
        )
        if output is not None:
            certified.write(output, force=force)
    return show(certified, outputs=outputs)


@click.command("verify", short_help="Check a certificate with exact arithmetic.")
@click.argument("certificate", metavar="CERTIFICATE", type=click.Path())
@click.argument("table", metavar="[TABLE]", type=click.Path(), required=False)
@json_option
def verify_command(certificate: str, table: str | None) -> int:
    """Check each claim of a certificate, which gaitgraph certify writes, as gaitgraph/certificates/check.py does.

    Each row of TABLE must be on the proven curve at its time. TABLE has any format that can be read, and may hold
    positions of servos. Without TABLE the table beside the certificate is compared, gait.csv beside gait.cert.json. The
    exit code is 1 if a claim is not proved or a row is not on the curve, 2 if a file is no certificate or no table.
    """
    from gaitgraph.certificates.verifying import verify

    with working(f"checking {certificate}"):
        answer = verify(certificate, table)
    return show(answer)

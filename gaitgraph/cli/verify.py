"""The command verify: check a certificate."""

from __future__ import annotations

from pathlib import Path

import click

from gaitgraph.cli import Working, command, file, print_json, wants_json


@command("Check a certificate with exact arithmetic.", file("certificate", "CERTIFICATE"), "json")
def verify_command(certificate: str) -> int:
    """Check each claim of a certificate, which gaitgraph certify writes, as gaitgraph/certificates/check.py does.

    The exit code is 1 if a claim is not proved, 2 if the file is no certificate.
    """
    from gaitgraph.certificates.check import check
    from gaitgraph.errors import InputError
    from gaitgraph.files import text_of

    text = text_of(Path(certificate), "certificate")
    with Working(f"checking {certificate}"):
        try:
            found = check(text)
        except (RecursionError, ValueError) as error:
            raise InputError(f"certificate {certificate!r}: {error}") from None
    is_proved = not any(place for _, place in found)
    if wants_json():
        print_json({"proved": is_proved, "claims": dict(found)})
    else:
        click.echo("\n".join(f"NOT proved: {name} {place}" if place else f"proved: {name}" for name, place in found))
    return 0 if is_proved else 1

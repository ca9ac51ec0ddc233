"""The command verify: check a certificate."""

from __future__ import annotations

from fractions import Fraction
from json import JSONDecodeError
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
            rule = "it must be JSON: " if isinstance(error, JSONDecodeError) else ""
            raise InputError(f"certificate {certificate!r}: {rule}{error}") from None
    values, lines = found["values"], found.pop("lines")
    flies = found["proved"] and "least_singular_value" in values and "hover_thrust" in values
    found["flyable"] = flies = flies and Fraction(values["hover_thrust"]["at_least"]) >= 0
    if wants_json():
        print_json(found)
    else:
        needs = "which takes least_singular_value, and hover_thrust with at_least 0 or more"
        click.echo("\n".join([*lines, *[f"not proved flyable, {needs}"] * (found["proved"] and not flies)]))
    return 0 if found["proved"] else 1

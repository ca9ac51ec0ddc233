"""The store of the explorer's page and its queries under node: tests/page has the tests."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

NODE = shutil.which("node")
FOLDER = Path(__file__).parent / "page"
OLDEST = 18  # has a runner of tests


def is_there() -> bool:
    """Return whether there is a node that runs tests."""
    if NODE is None:
        return False
    version = subprocess.run(
        [NODE, "--version"], check=False, capture_output=True, text=True
    ).stdout
    return int(version.strip().removeprefix("v").partition(".")[0] or 0) >= OLDEST


@pytest.mark.skipif(not is_there(), reason=f"install node {OLDEST} or newer")
def test_the_store_and_the_queries_of_the_page() -> None:
    command = [str(NODE), "--test", *map(str, sorted(FOLDER.glob("*.test.js")))]
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stdout
    assert "# fail 0" in done.stdout

"""The store of the explorer's page and its queries under node: tests/page has the tests."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

NODE = shutil.which("node")
FOLDER = Path(__file__).parent / "page"


@pytest.mark.skipif(NODE is None, reason="install node 18.18 or newer")
def test_the_store_and_the_queries_of_the_page() -> None:
    command = [str(NODE), "--test", *map(str, FOLDER.glob("*.test.js"))]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "# fail 0" in done.stdout

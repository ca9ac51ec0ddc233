"""Every benchmark still runs: once, untimed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
NOTHING_RAN = 5  # the exit code of pytest where every benchmark lacks its peer


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    sorted((ROOT / "tests/benchmarks").glob("test_*.py")),
    ids=lambda one: one.stem,
)
def test_benchmarks_run_once(path: Path) -> None:
    pytest.importorskip("pytest_benchmark", reason="install pytest-benchmark")
    command = [sys.executable, "-m", "pytest", "-q", "-n0", "--benchmark-disable"]
    done = subprocess.run(
        [*command, str(path)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode in (0, NOTHING_RAN), done.stdout

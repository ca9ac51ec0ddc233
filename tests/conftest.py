"""One behaviour for everyone in CI: the same examples in every run, locally new ones each time; and a command line."""

from __future__ import annotations

import gc
import json
import os
import signal
import sys
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, Phase, settings

from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from gaitgraph.timing.timed_gait import TimedGait

settings.register_profile("ci", derandomize=True)
# For docs/developers/mutation.md: one process runs the tests again and again; a failing example need not be made small.
settings.register_profile(
    "mutation",
    derandomize=True,
    deadline=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=[HealthCheck.differing_executors, HealthCheck.too_slow],
)
settings.load_profile(
    os.environ.get("HYPOTHESIS_PROFILE")
    or ("ci" if os.environ.get("CI") else "default")
)


def pytest_configure(config: pytest.Config) -> None:
    """Let interrupts reach tests that a shell started in the background; keep the marker known without pytest-cov."""
    gc.disable()  # what is collected stays; looking through it again and again takes a third of that time
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Workers inherit it: there is one for each core, and threads of their own make them wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    config.addinivalue_line("markers", "benchmark: timed by pytest-benchmark")
    told = "no_cover: runs untraced, which is two or three times as fast; other tests reach the same lines"
    config.addinivalue_line("markers", told)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave random examples untraced: they reach the lines that others reach, a hundred times over."""
    for item in items:
        if getattr(getattr(item, "obj", None), "is_hypothesis_test", False):
            item.add_marker(pytest.mark.no_cover)


def pytest_collection_finish() -> None:
    """Look for garbage among what the tests make alone."""
    gc.freeze()
    gc.enable()


@pytest.fixture(autouse=True)
def _no_window_left() -> Iterator[None]:
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture(scope="session")
def planned() -> TimedGait:
    """Gait 3 as planned for another vehicle, with nothing at its default."""
    import gaitgraph as gg

    asked: dict[str, Any] = {
        "vehicle": "beetle_omni",
        "period": 2.0,
        "law": "equal-time",
        "reverse": True,
    }
    return gg.plan_loop(GAITS[2].waypoints, **asked).timed(samples=12)


class Result:
    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    @property
    def json(self) -> Any:
        return json.loads(self.out)


@pytest.fixture
def run(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Any:
    from gaitgraph.cli import main

    monkeypatch.chdir(tmp_path)

    def call(*args: object) -> Result:
        with pytest.raises(SystemExit) as stopped:
            main([str(arg) for arg in args])
        captured = capsys.readouterr()
        code = stopped.value.code
        assert isinstance(code, int)
        return Result(code, captured.out, captured.err)

    return call

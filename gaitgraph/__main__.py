"""``python -m gaitgraph`` and the command ``gaitgraph``: interrupted quietly, even while modules are loaded."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType


def main() -> None:
    """Run the command line."""
    if (
        signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):  # it may be ignored, as in the background
        signal.signal(signal.SIGINT, _interrupt)
    from gaitgraph.cli import main as run

    atexit.register(
        gc.freeze
    )  # at the end of the process nothing need be searched for cycles
    run()


def _interrupt(_: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt; end at once while modules are loaded, since some turn it into another error."""
    while frame is not None:
        if frame.f_globals.get("__name__") == "importlib._bootstrap":
            sys.stderr.write("gaitgraph: interrupted\n")
            sys.stderr.flush()
            os._exit(130)
        frame = frame.f_back
    raise KeyboardInterrupt


if __name__ == "__main__":
    main()

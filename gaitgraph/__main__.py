"""``python -m gaitgraph`` and the command ``gaitgraph``: interrupted quietly, even while modules are loaded."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line."""
    try:
        from gaitgraph.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("gaitgraph: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    main()

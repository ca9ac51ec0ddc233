"""Run the command line by ``python -m gaitgraph``."""

from gaitgraph.cli import main

if __name__ == "__main__":
    main()

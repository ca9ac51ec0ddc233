"""The command explore: plan gaits by hand on a page in the browser."""

from __future__ import annotations

import click

from gaitgraph.cli.commands import command

__all__ = ["explore_command"]


@command("Plan gaits by hand, in the browser.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, metavar="N", help="Port; 0 for a free one.")
@click.option("--no-browser", is_flag=True, help="Print the address and open nothing.")
def explore_command(port: int, no_browser: bool) -> int:
    """Serve the explorer on the loopback address until interrupted, and open it in the browser.

    The first line printed is its address. It holds a secret: whoever knows it on this machine can use the page. Needs
    starlette and uvicorn: pip install 'gaitgraph[explore]'.
    """
    from gaitgraph.explorer.server import Listening

    server = Listening(port)
    try:
        click.echo(server.address)
        if not no_browser:
            _open(server.address)
        server.run()
    finally:
        server.close()
    return 0


def _open(address: str) -> None:
    """Open the browser beside the server, which may take a while or fail: the address is printed all the same."""
    import threading
    import webbrowser
    from contextlib import suppress

    def show() -> None:
        with suppress(Exception):
            webbrowser.open(address)

    threading.Thread(target=show, daemon=True).start()

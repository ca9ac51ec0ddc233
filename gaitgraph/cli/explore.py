"""The command explore: plan gaits by hand on a page in the browser."""

from __future__ import annotations

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import json_option
from gaitgraph.cli.terminal import print_json
from gaitgraph.errors import InputError, shown

__all__ = ["explore_command"]


def _port(_: click.Context, __: click.Parameter, text: str) -> int:
    """Return the port that a text names, or refuse it in one line."""
    if text.isascii() and text.isdecimal() and len(text) <= 5 and int(text) <= 65535:
        return int(text)
    raise InputError(f"--port: {shown(text)}; allowed is a whole number from 0 to 65535")


@command("Plan gaits by hand, in the browser.")
@click.option("--port", callback=_port, default="0", metavar="N", help="Port; 0 for a free one.")
@click.option("--no-browser", is_flag=True, help="Print the address and open nothing.")
@json_option
def explore_command(port: int, no_browser: bool, as_json: bool) -> int:
    """Serve the explorer on the loopback address until interrupted, and open it in the browser.

    The first line printed is its address. It holds a secret: whoever knows it on this machine can use the page. Needs
    starlette and uvicorn: pip install 'gaitgraph[explore]'.
    """
    from gaitgraph.explorer.server import Server

    server = Server(port)
    try:
        if as_json:
            print_json({"address": server.address})
        else:
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

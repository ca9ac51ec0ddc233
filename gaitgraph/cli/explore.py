"""The command explore: plan gaits by hand on a page in the browser."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gaitgraph.cli.options import VehicleName, Whole, json_option
from gaitgraph.cli.output import tell

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle


@click.command("explore", short_help="Plan gaits by hand, in the browser.")
@click.option(
    "--port",
    type=Whole(0, 65535),
    default=0,
    help="The port to listen on; 0 for a free one.",
)
@click.option("--no-browser", is_flag=True, help="Print the address and open nothing.")
@click.option(
    "--vehicle",
    type=VehicleName(),
    default="paper",
    help="The vehicle to begin with: a preset or a TOML file.",
)
@json_option
def explore_command(port: int, no_browser: bool, vehicle: Vehicle) -> int:
    """Serve the explorer on the loopback address until interrupted, and open it in the browser.

    The first line printed is its address. It contains a secret token: anyone on this machine who has it can use the
    page. Needs starlette and uvicorn: pip install 'gaitgraph[explore]'.
    """
    import threading
    import webbrowser
    from contextlib import suppress

    from gaitgraph.explorer.server import Server

    server = Server(port, vehicle)

    def open_page() -> None:
        with suppress(Exception):
            webbrowser.open(server.address)

    try:
        tell({"address": server.address}, [server.address])
        if not no_browser:
            # Beside the server, since opening may take a while or fail: the address is printed all the same.
            threading.Thread(target=open_page, daemon=True).start()
        server.run()
    finally:
        server.close()
    return 0

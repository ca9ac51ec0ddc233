"""The command explore: plan gaits by hand on a page in the browser."""

from __future__ import annotations

from gaitgraph.cli import command, flag, named_in_errors, option, tell, whole_from


@command(
    "Plan gaits by hand, in the browser.",
    option("--port", "N", "0 for a free one.  [default: 0]", type=whole_from(0, 65535)),
    flag("--no-browser", "Print the address and open nothing."),
    "json",
)
def explore_command(port: int = 0, no_browser: bool = False) -> int:
    """Serve the explorer on the loopback address until interrupted, and open it in the browser.

    The first line printed is its address. It contains a secret token: anyone on this machine who has it can use the
    page. Needs starlette and uvicorn: pip install 'gaitgraph[explore]'.
    """
    import threading
    import webbrowser
    from contextlib import suppress

    from gaitgraph.explorer.server import Server

    with named_in_errors({"port": port}):
        server = Server(port)

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

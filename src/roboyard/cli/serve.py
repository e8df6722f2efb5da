"""`roboyard serve`: a world that PyBullet scripts in several processes share."""

from __future__ import annotations

from typing import Annotated

import typer

EXAMPLES = """
Examples:

\b
  roboyard serve
  roboyard serve --port 0 --key 1234
"""


def serve(
    port: Annotated[int, typer.Option(help="Port for TCP and UDP; 0 for any free port.")] = 6667,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    key: Annotated[int, typer.Option(help="Key for connect(SHARED_MEMORY, key).")] = 12347,
) -> None:
    """Share one world between PyBullet scripts in several processes.

    Runs until Ctrl-C. Every process that can reach the port controls the world and can read files by name, so
    keep the default address unless the network is trusted.
    """
    from roboyard.pybullet.remote.server import serve_forever

    serve_forever(host=host, port=port, key=key)

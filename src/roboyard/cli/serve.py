"""`roboyard serve`: a process that owns a world which PyBullet scripts in other processes share."""

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
    port: Annotated[int, typer.Option(help="Port for TCP and UDP; 0 takes a free one.")] = 6667,
    host: Annotated[str, typer.Option(help="Address to listen at.")] = "127.0.0.1",
    key: Annotated[
        int, typer.Option(help="Key by which connect(SHARED_MEMORY, key) finds this server.")
    ] = 12347,
) -> None:
    """Share one world between PyBullet scripts in several processes.

    Runs until Ctrl-C. Whoever can reach the port controls the world and reads the files it names, so keep it
    on this machine (the default) unless the network is yours.
    """
    from roboyard.pybullet.remote.server import serve_forever

    serve_forever(host=host, port=port, key=key)

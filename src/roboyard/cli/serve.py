"""`roboyard serve`: a world that PyBullet scripts in several processes share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """
Examples:

\b
  roboyard serve
  roboyard serve --port 0 --key 1234
  roboyard serve --folder logs
"""


def serve(
    port: Annotated[int, typer.Option(help="Port for TCP and UDP; 0 for any free port.")] = 6667,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    key: Annotated[int, typer.Option(help="Key for connect(SHARED_MEMORY, key).")] = 12347,
    folder: Annotated[
        Path | None,
        typer.Option(help="Folder in which clients may write logs, videos and worlds; nowhere by default."),
    ] = None,
    token: Annotated[
        str | None,
        typer.Option(
            envvar="ROBOYARD_TOKEN",
            help="Token that clients give; by default a new one where other machines reach the address.",
        ),
    ] = None,
) -> None:
    """Share one world between PyBullet scripts in several processes.

    Runs until Ctrl-C. Every process that can reach the port, and has the token if there is one, controls the
    world and can load robot files by name. Any other address than this machine's own is guarded by a token,
    which is not encrypted on its way: keep the default address unless the network is trusted.
    """
    from roboyard.pybullet.remote.server import serve_forever

    serve_forever(host=host, port=port, key=key, folder=folder, token=token)

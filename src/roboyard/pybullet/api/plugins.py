"""Bullet's native plug-ins, which cannot be loaded here."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import text
from roboyard.pybullet.face.commands import command

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client


@command()
def loadPlugin(client: Client, pluginPath: str, postFix: str = "") -> int:
    """Return -1, as PyBullet does for a plug-in that fails to load; plug-ins are compiled for Bullet."""
    print(f"roboyard: cannot load the Bullet plug-in {text(pluginPath)!r}", file=sys.stderr)
    return -1


@command()
def unloadPlugin(client: Client, pluginUniqueId: int) -> None:
    """Do nothing: no plug-in is ever loaded."""


@command()
def executePluginCommand(
    client: Client,
    pluginUniqueId: int,
    textArgument: str = "",
    intArgs: Sequence[int] = (),
    floatArgs: Sequence[float] = (),
) -> int:
    """Return -1: no plug-in is ever loaded."""
    return -1

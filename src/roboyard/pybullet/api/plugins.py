"""Bullet's plug-ins: the fileIOPlugin with its mounts; others are compiled for Bullet and never load."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import text, whole
from roboyard.pybullet.face.commands import command

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

FILE_IO = "fileIOPlugin"
FILE_IO_ID = 3
"""Id of the fileIOPlugin in PyBullet, which has it from the start, after three others."""


@command()
def loadPlugin(client: Client, pluginPath: str, postFix: str = "") -> int:
    """Return the id of the fileIOPlugin; -1 for any other, as PyBullet does for one that fails to load."""
    if text(pluginPath) == FILE_IO:
        client.file_mounts()
        return FILE_IO_ID
    print(f"roboyard: cannot load the Bullet plug-in {text(pluginPath)!r}", file=sys.stderr)
    return -1


@command()
def unloadPlugin(client: Client, pluginUniqueId: int) -> None:
    """Unload the fileIOPlugin and remove its mounts; another id is ignored."""
    if whole(pluginUniqueId) == FILE_IO_ID:
        client.close_mounts()


@command()
def executePluginCommand(
    client: Client,
    pluginUniqueId: int,
    textArgument: str = "",
    intArgs: Sequence[int] = (),
    floatArgs: Sequence[float] = (),
) -> int:
    """Mount a folder or zip file, or remove a mount, in the fileIOPlugin; return the slot of the mount.

    Args:
        pluginUniqueId: id of loadPlugin.
        textArgument: a prefix of file names, or the path of a zip file.
        intArgs: (AddFileIOAction, PosixFileIO or ZipFileIO), or (RemoveFileIOAction, slot).
        floatArgs: not used.

    Returns:
        The slot of the mount; -1 for another plug-in, kind or action (CNSFileIO is not supported).
    """
    mounts, numbers = client.mounts, [whole(number) for number in intArgs]
    if whole(pluginUniqueId) != FILE_IO_ID or mounts is None:
        return -1
    if len(numbers) == 1:
        mounts.remove(numbers[0])
    if len(numbers) != 2:
        return -1
    action, value = numbers
    if action == c.AddFileIOAction:
        return mounts.add(value, text(textArgument))
    if action == c.RemoveFileIOAction:
        mounts.remove(value)
        return value
    return -1

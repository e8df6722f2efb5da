"""Virtual reality devices: none are supported, so there are no events."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face.commands import command

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client


@command()
def getVREvents(client: Client, deviceTypeFilter: int = 1, allAnalogAxes: int = 0) -> tuple[Any, ...]:
    """Return no events: virtual reality devices are not supported."""
    return ()


@command()
def setVRCameraState(
    client: Client,
    rootPosition: Sequence[float] | None = None,
    rootOrientation: Sequence[float] | None = None,
    trackObject: int = -2,
    trackObjectFlag: int = -1,
) -> None:
    """Do nothing: virtual reality devices are not supported."""

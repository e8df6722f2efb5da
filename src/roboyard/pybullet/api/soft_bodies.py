"""What cannot be had here: virtual reality, native plug-ins, soft bodies. Each says so when it is used."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face.arguments import text
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure

if TYPE_CHECKING:
    from roboyard.pybullet.connections import Client

_NO_SOFT_BODIES = "soft bodies are not simulated"


@command()
def getVREvents(client: Client, deviceTypeFilter: int = 1, allAnalogAxes: int = 0) -> tuple[Any, ...]:
    """No events: there are no virtual reality devices."""
    return ()


@command()
def setVRCameraState(
    client: Client,
    rootPosition: Sequence[float] | None = None,
    rootOrientation: Sequence[float] | None = None,
    trackObject: int = -2,
    trackObjectFlag: int = -1,
) -> None:
    """Nothing: there are no virtual reality devices."""


@command()
def loadPlugin(client: Client, pluginPath: str, postFix: str = "") -> int:
    """-1, PyBullet's answer for one that does not load: plug-ins are compiled against Bullet's own code."""
    print(f"roboyard: cannot load the Bullet plug-in {text(pluginPath)!r}", file=sys.stderr)
    return -1


@command()
def unloadPlugin(client: Client, pluginUniqueId: int) -> None:
    """Nothing: no plug-in is ever loaded."""


@command()
def executePluginCommand(
    client: Client,
    pluginUniqueId: int,
    textArgument: str = "",
    intArgs: Sequence[int] = (),
    floatArgs: Sequence[float] = (),
) -> int:
    """-1: no plug-in is ever loaded."""
    return -1


@command()
def loadSoftBody(
    client: Client,
    fileName: str,
    basePosition: Sequence[float] = (0, 0, 0),
    baseOrientation: Sequence[float] = (0, 0, 0, 1),
    scale: float = 1.0,
    mass: float = 0.0,
    collisionMargin: float = 0.0,
    useMassSpring: int = 0,
    useBendingSprings: int = 0,
    useNeoHookean: int = 0,
    springElasticStiffness: float = 1.0,
    springDampingStiffness: float = 0.1,
    springDampingAllDirections: int = 0,
    springBendingStiffness: float = 0.1,
    NeoHookeanMu: float = 1.0,
    NeoHookeanLambda: float = 1.0,
    NeoHookeanDamping: float = 0.1,
    frictionCoeff: float = 0.0,
    useFaceContact: int = 0,
    useSelfCollision: int = 0,
    repulsionStiffness: float = 0.5,
    simFileName: str = "",
) -> int:
    """Soft bodies are not simulated; always raises."""
    raise failure("Cannot load soft body.", _NO_SOFT_BODIES)


@command()
def createSoftBodyAnchor(
    client: Client,
    softBodyBodyUniqueId: int,
    nodeIndex: int,
    bodyUniqueId: int = -1,
    linkIndex: int = -1,
    bodyFramePosition: Sequence[float] = (0, 0, 0),
) -> int:
    """Soft bodies are not simulated; always raises."""
    raise failure("createSoftBodyAnchor failed.", _NO_SOFT_BODIES)


@command()
def getTetraMeshData(client: Client, bodyUniqueId: int, flags: int = 0) -> tuple[Any, ...]:
    """Soft bodies are not simulated; always raises."""
    raise failure("getTetraMeshData failed", _NO_SOFT_BODIES)


@command()
def resetMeshData(client: Client, bodyUniqueId: int, vertices: Sequence[Sequence[float]]) -> None:
    """Soft bodies are not simulated; always raises."""
    raise failure("resetMeshData failed", _NO_SOFT_BODIES)

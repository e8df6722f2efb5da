"""Soft bodies, which are not simulated: every function raises an error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

_NO_SOFT_BODIES = "soft bodies are not simulated; use rigid links connected by joints or constraints"


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
    """Raise an error: soft bodies are not simulated.

    Raises:
        error: always.
    """
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
    """Raise an error: soft bodies are not simulated.

    Raises:
        error: always.
    """
    raise failure("createSoftBodyAnchor failed.", _NO_SOFT_BODIES)


@command()
def getTetraMeshData(client: Client, bodyUniqueId: int, flags: int = 0) -> tuple[Any, ...]:
    """Raise an error: soft bodies are not simulated.

    Raises:
        error: always.
    """
    raise failure("getTetraMeshData failed", _NO_SOFT_BODIES)


@command()
def resetMeshData(client: Client, bodyUniqueId: int, vertices: Sequence[Sequence[float]]) -> None:
    """Raise an error: soft bodies are not simulated.

    Raises:
        error: always.
    """
    raise failure("resetMeshData failed", _NO_SOFT_BODIES)

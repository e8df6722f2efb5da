"""Soft bodies: cloth and solids that deform, their nodes, and anchors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import check_finite, number, quaternion, text, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.readers.deformable import DEFAULT_MARGIN, SoftModel, read_shape
from roboyard.pybullet.state.constraint_records import WORLD, ConstraintRecord
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.pybullet.state.soft_records import add_soft_body
from roboyard.sim.soft.materials import NeoHookean, Springs
from roboyard.transforms import rotate

if TYPE_CHECKING:
    from pathlib import Path

    from roboyard.pybullet.client import Client
    from roboyard.sim.soft.soft_body import SoftBody

_NO_BODY, _NO_ANCHOR = "Cannot load soft body.", "createSoftBodyAnchor failed."
_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


@command()
def loadSoftBody(
    client: Client,
    fileName: str,
    basePosition: Sequence[float] = (0, 0, 0),
    baseOrientation: Sequence[float] = (0, 0, 0, 1),
    scale: float = -1.0,
    mass: float = -1.0,
    collisionMargin: float = -1.0,
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
    """Load a soft body and return its id.

    Contacts are rigid and include faces, so `useFaceContact` has no effect.

    Args:
        fileName: OBJ or VTK file of the visible mesh; without `simFileName` its vertices are the nodes.
        basePosition: (3,) of the mesh's origin (m).
        baseOrientation: (4,) x, y, z, w.
        scale: of the mesh; 1 if it is not positive.
        mass: of all nodes together (kg); 1 if it is not positive.
        collisionMargin: distance from the nodes at which surfaces are (m); 0.02 if it is not positive.
        useMassSpring: springs along all edges.
        useBendingSprings: also between nodes two edges apart.
        useNeoHookean: an elastic solid, in the tetrahedra of a VTK file.
        springElasticStiffness: of springs along edges (N/m).
        springDampingStiffness: of the dampers beside all springs (N s/m).
        springDampingAllDirections: dampers act on the whole relative velocity, not only along the spring.
        springBendingStiffness: of the springs between nodes two edges apart (N/m).
        NeoHookeanMu: shear modulus (Pa).
        NeoHookeanLambda: second Lamé parameter (Pa).
        NeoHookeanDamping: time constant of the viscous stress (s).
        frictionCoeff: sliding friction coefficient.
        useFaceContact: no effect.
        useSelfCollision: parts of the body touch each other.
        repulsionStiffness: of the springs that keep its parts apart (N/m).
        simFileName: VTK or OBJ file of the nodes.

    Raises:
        error: a file does not exist or cannot be read, or a number is not finite.
    """
    position = vector3(basePosition, "Cannot convert basePosition.")
    orientation = quaternion(baseOrientation, "Cannot convert baseOrientation.")
    size, weight, margin = number(scale), number(mass), number(collisionMargin)
    elastic, damping = number(springElasticStiffness), number(springDampingStiffness)
    bending = number(springBendingStiffness) if whole(useBendingSprings) else None
    solid = number(NeoHookeanMu), number(NeoHookeanLambda), number(NeoHookeanDamping)
    friction, repulsion = number(frictionCoeff), number(repulsionStiffness)
    check_finite(
        _NO_BODY, basePosition=position, baseOrientation=orientation, scale=size, mass=weight,
        collisionMargin=margin, frictionCoeff=friction, repulsionStiffness=repulsion,
    )  # fmt: skip
    whole(useFaceContact)
    file = _existing(client, text(fileName))
    simulated = _existing(client, text(simFileName)) if simFileName else None
    try:
        materials: list[Springs | NeoHookean] = []
        if whole(useMassSpring):
            every = bool(whole(springDampingAllDirections))
            materials.append(
                Springs(
                    stiffness=elastic, damping=damping, damps_all_directions=every, bending_stiffness=bending
                )
            )
        nodes, elements, skin = read_shape(file, simulated, size if size > 0.0 else 1.0)
        if whole(useNeoHookean) and elements.shape[1] == 4:
            materials.append(NeoHookean(mu=solid[0], lam=solid[1], damping=solid[2]))
        soft = SoftModel(
            name=file.stem,
            file=file,
            nodes=nodes,
            elements=elements,
            skin=skin,
            materials=tuple(materials),
            mass=weight if weight > 0.0 else 1.0,
            margin=margin if margin > 0.0 else DEFAULT_MARGIN,
            friction=max(friction, 0.0),
            self_collision=bool(whole(useSelfCollision)),
            repulsion=max(repulsion, 0.0),
        )
        record = add_soft_body(client.scene, soft, position, orientation, link_name=file.stem, file=str(file))
    except RoboyardError as problem:
        raise failure(_NO_BODY, *str(problem).splitlines()) from problem
    return record.number


def _existing(client: Client, name: str) -> Path:
    path = find_file(client.search.folder, name, client.mounts)
    if path is None:
        raise failure(_NO_BODY, not_found_remedy(client.search.folder, name))
    return path


@command()
def createSoftBodyAnchor(
    client: Client,
    softBodyBodyUniqueId: int,
    nodeIndex: int,
    bodyUniqueId: int = -1,
    linkIndex: int = -1,
    bodyFramePosition: Sequence[float] = (0, 0, 0),
) -> int:
    """Hold a node of a soft body where it is in the world, or at a point of a link; return the constraint.

    Args:
        softBodyBodyUniqueId: the soft body.
        nodeIndex: index of the node.
        bodyUniqueId: body that holds it; -1 for the world.
        linkIndex: its link; -1 for the base.
        bodyFramePosition: (3,) point in the link's inertial frame (m).

    Raises:
        error: the body is not soft, or there is no such node, body or link.
    """
    scene = client.scene
    soft, node = _soft(client, softBodyBodyUniqueId, _NO_ANCHOR), whole(nodeIndex)
    holder, link = whole(bodyUniqueId), whole(linkIndex)
    point = vector3(bodyFramePosition, _NO_ANCHOR)
    check_finite(_NO_ANCHOR, bodyFramePosition=point)
    try:
        if holder < 0:
            place = (WORLD, -1)
            at = tuple(soft.positions[node].tolist()) if 0 <= node < len(soft.masses) else point
            made = soft.anchor(node)
        else:
            found = scene.link(holder, link)
            if found is None:
                raise failure(_NO_ANCHOR, f"there is no body {holder} with a link {link}")
            place, at = (holder, link), point
            frame = scene.bodies[holder].links[link + 1].frame
            made = soft.anchor(node, found, np.asarray(frame.position) + rotate(frame.quaternion, point))
    except RoboyardError as problem:
        raise failure(_NO_ANCHOR, str(problem)) from problem
    record = ConstraintRecord(
        number=scene.constraint_ids.take(),
        parent=(whole(softBodyBodyUniqueId), -1),
        child=place,
        kind=c.JOINT_POINT2POINT,
        axis=(0.0, 0.0, 0.0),
        parent_position=(0.0, 0.0, 0.0),
        parent_orientation=_NO_ROTATION,
        child_position=(at[0], at[1], at[2]),
        child_orientation=_NO_ROTATION,
        anchor=(soft, made),
    )
    scene.constraints[record.number] = record
    scene.constraint_order.append(record.number)
    return record.number


@command()
def getTetraMeshData(
    client: Client, bodyUniqueId: int, flags: int = 0
) -> tuple[int, tuple[tuple[float, ...], ...]]:
    """Return the number of nodes of a soft body and their positions in the world (m).

    Raises:
        error: the body is not soft.
    """
    whole(flags)
    return _rows(_soft(client, bodyUniqueId, "getTetraMeshData failed").positions)


@command()
def resetMeshData(client: Client, bodyUniqueId: int, vertices: Sequence[Sequence[float]]) -> None:
    """Move the nodes of a soft body to new positions in the world, (n, 3) (m), at rest.

    Raises:
        error: the body is not soft, or has another number of nodes.
    """
    message = "resetMeshData failed"
    soft = _soft(client, bodyUniqueId, message)
    try:
        soft.positions = np.asarray(vertices, dtype=float)
        soft.velocities = np.zeros((len(soft.masses), 3))
    except (RoboyardError, ValueError, TypeError) as problem:
        raise failure(message, str(problem)) from problem
    client.scene.frames_are_old = True


def soft_mesh(soft: SoftBody, *, simulated: bool) -> tuple[int, tuple[tuple[float, ...], ...]]:
    """Return number and positions in the world (m) of nodes, or of the corners of visible triangles."""
    if simulated:
        return _rows(soft.positions)
    return _rows(soft.skin.vertices(soft.positions)[soft.skin.mesh.faces.ravel()])


def _rows(points: np.ndarray) -> tuple[int, tuple[tuple[float, ...], ...]]:
    return len(points), tuple(map(tuple, points.tolist()))


def _soft(client: Client, body: int, message: str) -> SoftBody:
    record = client.scene.bodies.get(whole(body))
    if record is None or record.soft is None:
        raise failure(message, f"there is no soft body {body}")
    return record.soft

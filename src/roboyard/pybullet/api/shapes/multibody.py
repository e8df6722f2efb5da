"""Bodies made from shapes: createMultiBody."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.axes import unit_axis
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Joint,
    JointType,
    Limit,
    Mesh,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.errors import RoboyardError
from roboyard.pybullet.bullet_rules.models import BodyModel, LinkModel, plain_description
from roboyard.pybullet.bullet_rules.shape_bounds import link_bounds
from roboyard.pybullet.bullet_rules.shape_inertia import Moments, shape_moments
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import (
    Quaternion,
    Vector3,
    check_finite,
    number,
    quaternion,
    quaternion_or,
    vector3,
    vector3_or,
    whole,
)
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.bodies.body_records import MULTIBODY, RIGID_BODY
from roboyard.pybullet.state.pair_filters import self_collisions

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
_FAILED = "createMultiBody failed."
_NOWHERE, _IDENTITY = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
_TYPES: dict[int, JointType] = {0: "continuous", 1: "prismatic", 2: "spherical", 3: "planar", 4: "fixed"}
_PRIMITIVES = (Box, Capsule, Cylinder, Plane, Sphere)
_NO_RANGE = Limit(lower=1.0, upper=-1.0)
CACHE_SIZE = 256
"""Number of cached shapes and links; scripts create the same bodies many times."""
_VALUES = ("name", "mass", "moments", "frame", "collisions", "visuals", "joint", "parent")
_lone_models: dict[tuple[Any, ...], tuple[Any, Any, BodyModel]] = {}
"""Models of bodies without links, with their shapes, by mass, ids of the shapes and inertial frame."""
_bounds_of = partial(link_bounds, implicit_cylinder=True, from_file=False)
_known_bounds_of = lru_cache(CACHE_SIZE)(_bounds_of)
"""Cached bounds, for shapes that are not read from files."""
_values = attrgetter(*_VALUES)
"""Return all fields of a LinkModel as a tuple."""


@command()
def createMultiBody(
    client: Client,
    baseMass: float = 0.0,
    baseCollisionShapeIndex: int = -1,
    baseVisualShapeIndex: int = -1,
    basePosition: Vector = _NOWHERE,
    baseOrientation: Vector = _IDENTITY,
    baseInertialFramePosition: Vector = _NOWHERE,
    baseInertialFrameOrientation: Vector = _IDENTITY,
    linkMasses: Sequence[float] = (),
    linkCollisionShapeIndices: Sequence[int] = (),
    linkVisualShapeIndices: Sequence[int] = (),
    linkPositions: Sequence[Vector] = (),
    linkOrientations: Sequence[Vector] = (),
    linkInertialFramePositions: Sequence[Vector] = (),
    linkInertialFrameOrientations: Sequence[Vector] = (),
    linkParentIndices: Sequence[int] = (),
    linkJointTypes: Sequence[int] = (),
    linkJointAxis: Sequence[Vector] = (),
    useMaximalCoordinates: int = 0,
    flags: int = 0,
    batchPositions: Sequence[Vector] | None = None,
) -> int | tuple[int, ...]:
    """Create a body and return its id.

    Args:
        baseMass: mass of the base (kg); 0 for a fixed body.
        baseCollisionShapeIndex: id from createCollisionShape; -1 for none.
        baseVisualShapeIndex: id from createVisualShape; -1 shows the collision shape.
        basePosition: position of the base link frame (m).
        baseOrientation: orientation of the base link frame (x, y, z, w).
        baseInertialFramePosition: centre of mass in the base link frame (m).
        baseInertialFrameOrientation: orientation of the inertial frame (x, y, z, w).
        linkMasses: (n,) masses of the links (kg).
        linkCollisionShapeIndices: (n,) ids; -1 for none.
        linkVisualShapeIndices: (n,) ids; -1 for none.
        linkPositions: (n, 3) positions of the link frames in the parents' link frames (m).
        linkOrientations: (n, 4) orientations (x, y, z, w).
        linkInertialFramePositions: (n, 3) centres of mass in the link frames (m).
        linkInertialFrameOrientations: (n, 4) orientations (x, y, z, w).
        linkParentIndices: (n,) 0 for the base, else the index of the parent in these lists, from 1; links are
            numbered depth first, unless URDF_MAINTAIN_LINK_ORDER is set.
        linkJointTypes: (n,) JOINT_REVOLUTE, JOINT_PRISMATIC, JOINT_SPHERICAL or JOINT_FIXED.
        linkJointAxis: (n, 3) joint axes in the link frames.
        useMaximalCoordinates: 1 creates rigid bodies, whose joints scripts cannot access.
        flags: flags of loadURDF, as far as they apply.
        batchPositions: (k, 3) positions (m); creates a body at each and returns a tuple of ids.

    Vectors of the base that have another length are ignored, as in PyBullet.

    Raises:
        error: the lists have different lengths, a link's vector has the wrong length, or a link's parents do
            not lead to the base; with URDF_MAINTAIN_LINK_ORDER, a link comes before its parent.
    """
    lists = (
        linkMasses, linkCollisionShapeIndices, linkVisualShapeIndices, linkPositions, linkOrientations,
        linkInertialFramePositions, linkInertialFrameOrientations, linkParentIndices, linkJointTypes,
        linkJointAxis,
    )  # fmt: skip
    if len({len(values) for values in lists}) > 1:
        raise failure(
            "All link arrays need to be same size.", f"got lists of {[len(values) for values in lists]} items"
        )
    scene = client.scene
    frame = _unit_pose(
        vector3_or(baseInertialFramePosition, _NOWHERE),
        quaternion_or(baseInertialFrameOrientation, _IDENTITY),
    )
    base = number(baseMass), whole(baseCollisionShapeIndex), whole(baseVisualShapeIndex), frame
    if not len(linkParentIndices):
        model = _lone_model(scene, *base)
    else:
        parents = [whole(parent) for parent in linkParentIndices]
        keeps_order = bool(whole(flags) & c.URDF_MAINTAIN_LINK_ORDER)
        order = range(1, len(parents) + 1) if keeps_order else _depth_first(parents)
        rows, links, places = list(zip(*lists, strict=True)), [_link(scene, "link0", *base)], {0: -1}
        for given in order:
            links.append(_jointed_link(scene, given, places, *rows[given - 1]))
            places[given] = len(places) - 1
        model = _model(links)
    place = vector3_or(basePosition, _NOWHERE), quaternion_or(baseOrientation, _IDENTITY)
    rigid = bool(whole(useMaximalCoordinates))
    places = [place[0]] if batchPositions is None or not len(batchPositions) else batchPositions
    ids = []
    for position in places:
        try:
            record = scene.add(
                model if len(places) == 1 else model.copied(),
                vector3(position, _FAILED),
                place[1],
                self_collisions=self_collisions(whole(flags)),
                kind=RIGID_BODY if rigid else MULTIBODY,
            )
        except (RoboyardError, ValueError) as problem:
            raise failure(_FAILED, str(problem)) from problem
        ids.append(record.number)
    return ids[0] if batchPositions is None or not len(batchPositions) else tuple(ids)


def _lone_model(scene: PhysicsScene, mass: float, collision: int, visual: int, frame: Pose) -> BodyModel:
    """Return the model of a body without links; cached by its shapes where these never change."""
    shapes, look = scene.collision_shapes.get(collision), scene.visual_shapes.get(visual)
    key = mass, id(shapes), id(look), frame.position, frame.quaternion
    known = _lone_models.get(key)
    if known is None or known[0] is not shapes or known[1] is not look:
        model = _model([_link(scene, "link0", mass, collision, visual, frame)])
        if not _is_plain(model.description):
            return model
        known = _lone_models[key] = shapes, look, model
        while len(_lone_models) > CACHE_SIZE:
            del _lone_models[next(iter(_lone_models))]
    return known[2].copied()  # a base that is freed is noted there


def _link(scene: PhysicsScene, name: str, mass: float, collision: int, visual: int, frame: Pose) -> LinkModel:
    check_finite(_FAILED, mass=mass)
    shapes: tuple[Collision, ...] = ()
    visuals: tuple[Visual, ...] = ()
    if whole(collision) in scene.collision_shapes:
        shapes = scene.collision_shapes[collision].shapes
    if whole(visual) in scene.visual_shapes:
        visuals = scene.visual_shapes[visual].visuals
    return LinkModel(
        name=name,
        mass=mass,
        moments=_moments(mass, frame, shapes),
        frame=frame,
        collisions=shapes,
        visuals=visuals,
    )


def _moments(mass: float, frame: Pose, shapes: tuple[Collision, ...]) -> Moments:
    if not mass:
        return 0.0, 0.0, 0.0
    from_files = any(isinstance(shape.geometry, Mesh) for shape in shapes)
    return shape_moments(mass, (_bounds_of if from_files else _known_bounds_of)(frame, shapes))


def _depth_first(parents: Sequence[int]) -> list[int]:
    """Return the links, from 1, depth first from the base (0); children of one link stay in order."""
    children: dict[int, list[int]] = {}
    for link, parent in enumerate(parents, 1):
        children.setdefault(parent, []).append(link)
    order, waiting = [], children.get(0, [])[::-1]
    while waiting:
        link = waiting.pop()
        order.append(link)
        waiting.extend(reversed(children.get(link, ())))
    if len(order) < len(parents):
        lost = next(link for link in range(1, len(parents) + 1) if link not in order)
        raise failure(
            _FAILED,
            f"the parent of link {lost - 1} is {parents[lost - 1]}; it does not lead to the base",
        )
    return order


def _jointed_link(
    scene: PhysicsScene, number_: int, places: dict[int, int], mass: float, collision: int, visual: int,
    position:
    Vector,
    orientation: Vector, frame_position: Vector, frame_orientation: Vector, parent: int, kind: int, axis:
    Vector,
) -> LinkModel:  # fmt: skip
    frame = _pose(frame_position, frame_orientation)
    link = _link(scene, f"link{number_}", number(mass), collision, visual, frame)
    if whole(parent) not in places:
        raise failure(
            _FAILED, f"the parent of link {number_ - 1} is {parent}; parents must come before their children"
        )
    direction, length = unit_axis(vector3(axis, _FAILED))
    link.parent = places[parent]
    link.joint = Joint(
        name=f"joint{number_}",
        type=_TYPES.get(whole(kind), "fixed"),
        parent=f"link{parent}",
        child=link.name,
        origin=_pose(position, orientation),
        axis=direction,
        axis_length=length,
        limit=_NO_RANGE,
    )
    return link


def _model(links: list[LinkModel]) -> BodyModel:
    description, shared = _described(*(_values(link) for link in links))
    return BodyModel(
        name="",
        links=links,
        description=description,
        fixed_base=links[0].mass == 0.0,
        implicit_cylinder=True,
        bounds_of=_bounds_of,
        nests_meshes=False,
        shared=shared if _is_plain(description) else {},
    )


def _is_plain(description: RobotDescription) -> bool:
    """Return whether all shapes are primitives, which never change, unlike files and heights of a terrain."""
    shapes = (shape for link in description.links for shape in (*link.collisions, *link.visuals))
    return all(isinstance(shape.geometry, _PRIMITIVES) for shape in shapes)


@lru_cache(CACHE_SIZE)
def _described(*links: tuple[Any, ...]) -> tuple[RobotDescription, dict[str, Any]]:
    """Return the World's description of links given as `_values`, and room for what such bodies share.

    Cached, so equal links share one object.
    """
    models = [LinkModel(**dict(zip(_VALUES, values, strict=True))) for values in links]
    return plain_description(models), {}


def _pose(position: Vector, orientation: Vector) -> Pose:
    return _unit_pose(vector3(position, _FAILED), quaternion(orientation, _FAILED))


@lru_cache(CACHE_SIZE)
def _unit_pose(position: Vector3, orientation: Quaternion) -> Pose:
    q = np.array(orientation)
    x, y, z, w = (float(v) for v in q / (np.linalg.norm(q) or 1.0))
    return Pose(position=position, quaternion=(x, y, z, w))

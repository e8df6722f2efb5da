"""Pictures of an imported robot: visual shapes, collision shapes and planning spheres."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import Collision, Link, Mesh, RobotDescription, Visual
from roboyard.description.robot_model import CollisionSphere, RobotModel
from roboyard.errors import MeshError
from roboyard.importer.planning.rest_posture import nearest_to_zero
from roboyard.kinematics.description_poses import forward_kinematics, vector_joints
from roboyard.rendering import RenderShape
from roboyard.rendering.mesh_arrays import mesh_arrays
from roboyard.reports.pictures import PLAIN, RGBA, SceneView, gathered
from roboyard.shapes import primitives
from roboyard.shapes.simplify import for_small_pictures
from roboyard.transforms import Array, matrix_from_quaternion

Kind = Literal["visual shapes", "collision shapes", "planning spheres"]
KINDS: tuple[Kind, ...] = ("visual shapes", "collision shapes", "planning spheres")
HULL_RGBA: tuple[RGBA, ...] = (
    (0.35, 0.72, 0.42, 1.0),
    (0.31, 0.56, 0.85, 1.0),
    (0.91, 0.65, 0.27, 1.0),
    (0.73, 0.46, 0.80, 1.0),
    (0.87, 0.42, 0.40, 1.0),
    (0.30, 0.70, 0.72, 1.0),
    (0.82, 0.76, 0.34, 1.0),
    (0.55, 0.50, 0.85, 1.0),
)
"""Colours of consecutive collision shapes, so that hulls are distinguishable."""
SPHERE_RGBA: RGBA = (0.95, 0.55, 0.12, 0.55)
GHOST: RGBA = (0.55, 0.60, 0.68, 1.0)
"""Colour of the link behind its spheres."""
SEGMENTS = 20
"""Segments of a sphere's equator; a robot has hundreds, each drawn in several transparent layers."""


def view_of_robot(
    robot: RobotModel,
    kind: Kind,
    only: Collection[str] | None = None,
    *,
    frames: Mapping[str, Array] | None = None,
) -> SceneView:
    """Return a view of the robot, or of some of its links, ready to be rendered.

    Args:
        robot: the robot.
        kind: the shapes to show.
        only: names of the links to show; all by default.
        frames: (4, 4) pose of each link in the root link's frame; those of `resting_frames` by default.
    """
    frames = frames if frames is not None else resting_frames(robot.description)
    return gathered(
        (link.name, frames[link.name], partial(_shapes, robot, link, kind))
        for link in robot.description.links
        if only is None or link.name in only
    )


def warm_up() -> None:
    """Draw a ball, so that everything is loaded that draws."""
    ball = _sphere(CollisionSphere(center=(0.0, 0.0, 0.0), radius=1.0), 0)
    gathered([("ball", np.eye(4), lambda _: [ball])]).picture(width=16, height=16)


def prepare_visuals(description: RobotDescription) -> None:
    """Load and simplify the visual meshes of a robot, which pictures of it will need."""
    for link in description.links:
        for visual in link.visuals:
            with suppress(MeshError):  # raised again where the robot is drawn
                if (shape := drawn_shape(visual, 0, None)) is not None:
                    mesh_arrays(shape.mesh)


def resting_frames(description: RobotDescription) -> dict[str, Array]:
    """Return the (4, 4) pose of each link in the root link's frame, each joint at zero or the limit nearest
    to it.

    The vendor's file is drawn in this posture too.
    """
    joints = vector_joints(description)
    return forward_kinematics(description, {joint.name: nearest_to_zero(joint) for joint in joints})


def link_pictures(
    robot: RobotModel, link: str, frames: Mapping[str, Array], *, width: int, height: int
) -> dict[Kind, bytes]:
    """Return a PNG of one link for each kind of shape that it has, all from the same viewpoint.

    Args:
        robot: the robot.
        link: name of the link.
        frames: (4, 4) pose of each link in the root link's frame.
        width: pixels.
        height: pixels.
    """
    views: dict[Kind, SceneView] = {
        kind: view_of_robot(robot, kind, (link,), frames=frames) for kind in KINDS
    }
    around = np.concatenate([view.points() for view in views.values()])
    return {
        kind: view.picture(around=around, width=width, height=height, plain=True)
        for kind, view in views.items()
        if not view.is_empty
    }


def _shapes(robot: RobotModel, link: Link, kind: Kind, frame: int) -> Iterator[RenderShape]:
    if kind == "collision shapes":
        drawn = (drawn_shape(shape, frame, None) for shape in link.collisions)
        seen = [shape for shape in drawn if shape is not None]
        for index, shape in enumerate(seen):
            yield replace(shape, rgba=HULL_RGBA[index % len(HULL_RGBA)])
        return
    spheres: list[RenderShape] = []
    if kind == "planning spheres":
        planned = () if robot.planning is None else robot.planning.spheres.get(link.name, ())
        spheres = [_sphere(sphere, frame) for sphere in planned if sphere.radius > 0]
        if not spheres:
            return
    for visual in link.visuals:
        shape = drawn_shape(visual, frame, GHOST if spheres else None)
        if shape is not None:
            yield shape
    yield from spheres


def _sphere(sphere: CollisionSphere, frame: int) -> RenderShape:
    d = 2.0 * sphere.radius
    return RenderShape(
        mesh=primitives.sphere(segments=SEGMENTS),
        scale=(d, d, d),
        position=np.asarray(sphere.center, dtype=float),
        rotation=np.eye(3),
        frame=frame,
        owner=(0, frame),
        rgba=SPHERE_RGBA,
    )


def drawn_shape(shape: Visual | Collision, frame: int, rgba: RGBA | None) -> RenderShape | None:
    """Return a shape in `rgba`, or a visual one in its own colours; None for infinite or empty geometry."""
    geometry, scale = shape.geometry, (1.0, 1.0, 1.0)
    if isinstance(geometry, Mesh):  # the renderer scales, so that one mesh is prepared once
        geometry, scale = replace(geometry, scale=scale), geometry.scale
    mesh = geometry_mesh(geometry)
    if mesh is None or not len(mesh.faces):
        return None
    mesh = for_small_pictures(mesh)
    material = shape.material if isinstance(shape, Visual) else None
    own = rgba or (material.rgba if material is not None else None)
    colored = mesh.colors is not None or mesh.texture is not None
    return RenderShape(
        mesh=mesh,
        scale=scale,
        position=np.asarray(shape.origin.position, dtype=float),
        rotation=matrix_from_quaternion(shape.origin.quaternion),
        frame=frame,
        owner=(0, frame),
        rgba=own or ((1.0, 1.0, 1.0, 1.0) if colored else PLAIN),
        use_mesh_colors=own is None,
    )

"""Pictures of an imported robot: what is seen, what touches, what a planner takes it for."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import Collision, Link, Mesh, RobotDescription, Visual
from roboyard.description.robot_model import CollisionSphere, RobotModel
from roboyard.importer.planning.rest_posture import nearest_to_zero
from roboyard.kinematics.description_poses import forward_kinematics, vector_joints
from roboyard.rendering import RenderShape
from roboyard.reports.pictures import PLAIN, RGBA, SceneView, gathered
from roboyard.shapes import primitives
from roboyard.shapes.simplify import for_small_pictures
from roboyard.transforms import Array, matrix_from_quaternion

Kind = Literal["visual shapes", "collision shapes", "planner's spheres"]
KINDS: tuple[Kind, ...] = ("visual shapes", "collision shapes", "planner's spheres")
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
"""Neighbouring collision shapes in different colours, so that hulls can be told apart."""
SPHERE_RGBA: RGBA = (0.95, 0.55, 0.12, 0.55)
GHOST: RGBA = (0.55, 0.60, 0.68, 1.0)
"""The link itself, behind its spheres."""
SEGMENTS = 20
"""Round the equator of a planner's sphere; a robot has hundreds, each drawn in several see-through layers."""


def view_of_robot(
    robot: RobotModel,
    kind: Kind,
    only: Collection[str] | None = None,
    *,
    frames: Mapping[str, Array] | None = None,
) -> SceneView:
    """The robot (or some of its links) with each joint at its nearest to zero, ready to be photographed.

    `frames` are those of `resting_frames`, or another posture's.
    """
    frames = frames if frames is not None else resting_frames(robot.description)
    return gathered(
        (link.name, frames[link.name], partial(_shapes, robot, link, kind))
        for link in robot.description.links
        if only is None or link.name in only
    )


def resting_frames(description: RobotDescription) -> dict[str, Array]:
    """(4, 4) poses of all links in the root's frame, each joint at zero or at the limit nearest to it.

    The vendor's file is drawn like this too, so that both pictures show one posture.
    """
    joints = vector_joints(description)
    return forward_kinematics(description, {joint.name: nearest_to_zero(joint) for joint in joints})


def link_pictures(
    robot: RobotModel, link: str, frames: Mapping[str, Array], *, width: int, height: int
) -> dict[Kind, bytes]:
    """PNG of one link alone in each way that it has, all from one place."""
    sights: dict[Kind, SceneView] = {
        kind: view_of_robot(robot, kind, (link,), frames=frames) for kind in KINDS
    }
    around = np.concatenate([sight.points() for sight in sights.values()])
    return {
        kind: sight.picture(around=around, width=width, height=height, plain=True)
        for kind, sight in sights.items()
        if not sight.is_empty
    }


def _shapes(robot: RobotModel, link: Link, kind: Kind, frame: int) -> Iterator[RenderShape]:
    if kind == "collision shapes":
        drawn = (_drawn(shape, frame, None) for shape in link.collisions)
        seen = [shape for shape in drawn if shape is not None]
        for index, shape in enumerate(seen):
            yield replace(shape, rgba=HULL_RGBA[index % len(HULL_RGBA)])
        return
    balls: list[RenderShape] = []
    if kind == "planner's spheres":
        spheres = () if robot.planning is None else robot.planning.spheres.get(link.name, ())
        balls = [_ball(ball, frame) for ball in spheres if ball.radius > 0]
        if not balls:
            return
    for visual in link.visuals:
        shape = _drawn(visual, frame, GHOST if balls else None)
        if shape is not None:
            yield shape
    yield from balls


def _ball(ball: CollisionSphere, frame: int) -> RenderShape:
    d = 2.0 * ball.radius
    return RenderShape(
        mesh=primitives.sphere(segments=SEGMENTS),
        scale=(d, d, d),
        position=np.asarray(ball.center, dtype=float),
        rotation=np.eye(3),
        frame=frame,
        owner=(0, frame),
        rgba=SPHERE_RGBA,
    )


def _drawn(shape: Visual | Collision, frame: int, rgba: RGBA | None) -> RenderShape | None:
    """A shape in `rgba`, or (visual ones) in its own colours; None for what has no end or no size."""
    geometry, scale = shape.geometry, (1.0, 1.0, 1.0)
    if isinstance(geometry, Mesh):  # the renderer scales, so that one mesh is prepared but once
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

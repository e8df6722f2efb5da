"""Pictures of an imported robot: what is seen, what touches, what a planner takes it for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from roboyard.cameras import RenderScene, RenderShape
from roboyard.importer.model import ImportedRobot
from roboyard.importer.shape_tools import geometry_mesh
from roboyard.poses import Array, matrix_from_quaternion
from roboyard.reports.pictures import PLAIN, Sight
from roboyard.shapes import primitives
from roboyard.urdf.kinematics import forward_kinematics
from roboyard.urdf.model import Link, Visual

Kind = Literal["visual shapes", "collision shapes", "planner's spheres"]
KINDS: tuple[Kind, ...] = ("visual shapes", "collision shapes", "planner's spheres")
COLLISION_RGBA = (0.35, 0.72, 0.42, 1.0)
SPHERE_RGBA = (0.92, 0.58, 0.2, 1.0)


def sights_of(robot: ImportedRobot, kind: Kind) -> Sight:
    """The robot with all joints at zero, ready to be photographed."""
    frames = forward_kinematics(robot.description)
    shapes: list[RenderShape] = []
    positions, rotations = [], []
    bounds: dict[str, Array] = {}
    for link in robot.description.links:
        pose = frames[link.name]
        drawn = list(_shapes(robot, link, kind, len(positions)))
        if not drawn:
            continue
        positions.append(pose[:3, 3])
        rotations.append(pose[:3, :3])
        shapes += drawn
        points = (
            np.concatenate([(s.mesh.vertices * s.scale) @ s.rotation.T + s.position for s in drawn])
            @ pose[:3, :3].T
        )
        points = points + pose[:3, 3]
        bounds[link.name] = np.stack([points.min(axis=0), points.max(axis=0)])
    return Sight(
        scene=RenderScene(shapes=shapes),
        positions=np.array(positions).reshape(-1, 3),
        rotations=np.array(rotations).reshape(-1, 3, 3),
        bounds=bounds,
    )


def _shapes(robot: ImportedRobot, link: Link, kind: Kind, frame: int) -> Iterator[RenderShape]:
    if kind == "planner's spheres":
        spheres = () if robot.planning is None else robot.planning.spheres.get(link.name, ())
        for ball in spheres:
            if ball.radius > 0:
                d = 2.0 * ball.radius
                yield RenderShape(
                    mesh=primitives.sphere(),
                    scale=(d, d, d),
                    position=np.asarray(ball.center, dtype=float),
                    rotation=np.eye(3),
                    frame=frame,
                    owner=(0, frame),
                    rgba=SPHERE_RGBA,
                )
        return
    for shape in link.visuals if kind == "visual shapes" else link.collisions:
        mesh = geometry_mesh(shape.geometry)
        if mesh is None or not len(mesh.faces):
            continue
        material = shape.material if isinstance(shape, Visual) else None
        own = mesh.colors is not None or mesh.texture is not None
        rgba = material.rgba if material is not None else None
        is_visual = isinstance(shape, Visual)
        yield RenderShape(
            mesh=mesh,
            position=np.asarray(shape.origin.position, dtype=float),
            rotation=matrix_from_quaternion(shape.origin.quaternion),
            frame=frame,
            owner=(0, frame),
            rgba=COLLISION_RGBA if not is_visual else rgba or ((1.0, 1.0, 1.0, 1.0) if own else PLAIN),
            use_mesh_colors=is_visual and rgba is None,
        )

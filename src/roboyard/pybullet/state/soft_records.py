"""Soft bodies of a client: records of bodies whose shape is that of nodes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from roboyard.description.model import Mesh, Pose, Visual
from roboyard.pybullet.bullet_rules.models import BodyModel, LinkModel
from roboyard.pybullet.bullet_rules.shape_bounds import link_bounds
from roboyard.pybullet.state.pair_filters import NO_SELF_COLLISIONS
from roboyard.sim.soft.materials import Springs

if TYPE_CHECKING:
    from roboyard.pybullet.face.arguments import Quaternion, Vector3
    from roboyard.pybullet.readers.deformable import SoftModel
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

_WHITE = (1.0, 1.0, 1.0, 1.0)
"""Colour until a script gives another one."""
_STIFFEST = 0.1
"""Stiffness, times time step squared over a node's mass, of surfaces without a material."""


def add_soft_body(
    scene: PhysicsScene,
    soft: SoftModel,
    position: Vector3,
    orientation: Quaternion,
    *,
    link_name: str,
    file: str,
) -> BodyRecord:
    """Add a soft body to the World and return its record.

    A body without a material becomes a net of springs, as stiff as one time step allows. That is what
    Bullet's position-based solver makes of it outside its world of deformable bodies.

    Args:
        scene: the bodies of the client.
        soft: nodes and materials.
        position: of the nodes' origin (m).
        orientation: of the nodes' frame (x, y, z, w).
        link_name: of the base.
        file: the file that it was loaded from.
    """
    materials = soft.materials
    if not materials:
        stiffness = _STIFFEST * soft.mass / len(soft.nodes) / scene.time_step**2
        materials = (Springs(stiffness=stiffness, damping=0.1 * stiffness * scene.time_step),)
    made = scene.world.add_soft_body(
        soft.nodes,
        soft.elements,
        position,
        orientation,
        mass=soft.mass,
        material=materials,
        radius=soft.margin,
        friction=soft.friction,
        self_collision=soft.self_collision,
        repulsion=soft.repulsion,
        skin=soft.skin,
        rgba=_WHITE,
        name=soft.name,
    )
    description = made.body.description
    assert description is not None
    visual = Visual(geometry=Mesh(uri=str(soft.file), path=soft.file, scale=(1.0, 1.0, 1.0)))
    link = LinkModel(
        name=link_name,
        mass=soft.mass,
        moments=(0.0, 0.0, 0.0),
        frame=Pose(),
        collisions=(),
        visuals=(visual,),
    )
    model = BodyModel(
        name=soft.name,
        links=[link],
        description=description,
        fixed_base=True,
        implicit_cylinder=True,
        bounds_of=partial(link_bounds, implicit_cylinder=True, from_file=True),
    )
    record = scene.enter(model, made.body, file=file)
    record.soft = made
    record.links[0].friction = soft.friction
    scene.filters.add_body(record, NO_SELF_COLLISIONS)
    scene.textures.add_body(record)
    return record

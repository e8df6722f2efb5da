"""Joints that close loops of links, outside the articulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from roboyard.export.names import identifiers
from roboyard.export.usd.geometry import frame_to
from roboyard.export.usd.library import Sdf, UsdPhysics
from roboyard.export.usd.naming import Paths, keep_name
from roboyard.export.usd.values import quatf, vec3f
from roboyard.transforms import multiply

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

_KINDS = {"revolute": "RevoluteJoint", "spherical": "SphericalJoint", "fixed": "FixedJoint"}


def add_loops(stage: Any, robot: RobotModel, paths: Paths) -> None:
    """Define every loop joint under its first link, excluded from the articulation."""
    taken = set(paths.joints.values())
    names = identifiers((loop.name for loop in robot.description.loops), tuple(taken), "loop")
    for loop in robot.description.loops:
        path = f"{paths.link(loop.first)}/{names[loop.name]}"
        prim = getattr(UsdPhysics, _KINDS[loop.type]).Define(stage, path).GetPrim()
        keep_name(prim, loop.name, robot)
        token, turn = frame_to(loop.axis)
        if loop.type == "revolute":
            UsdPhysics.RevoluteJoint(prim).CreateAxisAttr(token)
        base = UsdPhysics.Joint(prim)
        base.CreateBody0Rel().SetTargets([Sdf.Path(paths.link(loop.first))])
        base.CreateBody1Rel().SetTargets([Sdf.Path(paths.link(loop.second))])
        base.CreateLocalPos0Attr(vec3f(loop.first_origin.position))
        base.CreateLocalRot0Attr(quatf(multiply(loop.first_origin.quaternion, turn)))
        base.CreateLocalPos1Attr(vec3f(loop.second_origin.position))
        base.CreateLocalRot1Attr(quatf(multiply(loop.second_origin.quaternion, turn)))
        base.CreateExcludeFromArticulationAttr(True)

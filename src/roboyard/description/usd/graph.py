"""The rigid bodies of a stage and the joints between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from roboyard.description.usd.frames import Frames
from roboyard.description.usd.joints import Motion, motions_of
from roboyard.description.usd.library import UsdGeom, UsdPhysics
from roboyard.description.usd.stage import OpenStage
from roboyard.transforms import Array

WORLD = ""
"""Instead of a path: what is no rigid body."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StageJoint:
    """A joint between two bodies."""

    prim: Any
    parent: str
    """Path of body 0, or `WORLD`."""
    child: str
    """Path of body 1, or `WORLD`."""
    T_parent: Array
    """(4, 4) frame of the joint in the parent (m)."""
    T_child: Array
    """(4, 4) frame of the joint in the child (m)."""
    motions: tuple[Motion, ...]
    more: tuple[StageJoint, ...] = ()
    """Joints between the same bodies that add motions to this one, as joints of one MuJoCo body do."""
    is_loop: bool
    """Not part of the articulation, as the stage says."""
    is_point: bool
    """MuJoCo's `connect`: only the origins of both frames stay together."""


def is_body(prim: Any) -> bool:
    """Return whether a prim is a rigid body that is switched on."""
    if not prim.HasAPI(UsdPhysics.RigidBodyAPI):
        return False
    return UsdPhysics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get() is not False


def owner_of(prim: Any, bodies: dict[str, Any]) -> str:
    """Return the path of the body that a prim is, or is below; `WORLD` without one."""
    above = prim
    while above and not above.IsPseudoRoot():
        path = str(above.GetPath())
        if path in bodies:
            return path
        if above.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(above).GetResetXformStack():
            return WORLD
        above = above.GetParent()
    return WORLD


def joints_of(
    opened: OpenStage, bodies: dict[str, Any], frames: Frames, note: Callable[[str], None]
) -> list[StageJoint]:
    """Return the joints that are switched on and join two bodies, or a body and the world.

    Args:
        opened: the stage.
        bodies: path to prim.
        frames: of the stage.
        note: gets a note for each joint that is omitted.
    """
    found = []
    for prim in opened.prims:
        if not prim.IsA(UsdPhysics.Joint):
            continue
        api, name = UsdPhysics.Joint(prim), str(prim.GetName())
        if api.GetJointEnabledAttr().Get() is False:
            note(f"joint {name!r} is omitted: it is switched off")
            continue
        targets = [_target(opened, relation) for relation in (api.GetBody0Rel(), api.GetBody1Rel())]
        ends = [WORLD if target is None else owner_of(target, bodies) for target in targets]
        if ends[0] == ends[1]:
            note(f"joint {name!r} is omitted: it does not join two bodies")
            continue
        motions = motions_of(prim, opened)
        if any(motion.kind == "free" for motion in motions):
            note(f"joint {name!r} is omitted: it leaves all motions free")
            continue
        parent, child = (
            frames.joint_frame(prim, number, target, bodies.get(end))
            for number, (target, end) in enumerate(zip(targets, ends, strict=True))
        )
        if _leaves_world_open(api, targets):  # then it holds the body where it is drawn, as engines take it
            if targets[0] is None:
                parent = frames.rigid(bodies[ends[1]]) @ child
            else:
                child = frames.rigid(bodies[ends[0]]) @ parent
        schemas = _schemas(prim)
        constraint = "MjcEqualityConnectAPI" in schemas or "MjcEqualityWeldAPI" in schemas
        found.append(
            StageJoint(
                prim=prim,
                parent=ends[0],
                child=ends[1],
                T_parent=parent,
                T_child=child,
                motions=motions,
                is_loop=constraint or api.GetExcludeFromArticulationAttr().Get() is True,
                is_point="MjcEqualityConnectAPI" in schemas,
            )
        )
    return _stacked(found, opened)


def _stacked(joints: list[StageJoint], opened: OpenStage) -> list[StageJoint]:
    """Return the joints, those between the same bodies as one where the stage means that they add motions.

    It says so for an articulation, or they are MuJoCo's; to UsdPhysics all of them would hold at once.
    """
    adding = any(prim.GetAttribute("newton:jointsAddMobility").Get() for prim in opened.prims)
    out: dict[object, StageJoint] = {}
    for joint in joints:
        alike = (adding or "MjcJointAPI" in _schemas(joint.prim)) and not joint.is_loop and joint.motions
        key = (joint.parent, joint.child) if alike else id(joint)
        first = out.get(key)
        out[key] = joint if first is None else replace(first, more=(*first.more, joint))
    return list(out.values())


def roots_of(opened: OpenStage, bodies: dict[str, Any], joints: list[StageJoint]) -> list[str]:
    """Return the bodies at which articulations begin: ArticulationRootAPI is on a body, a joint, or above."""
    found = []
    by_path = {str(joint.prim.GetPath()): joint for joint in joints}
    for prim in opened.prims:
        if not prim.HasAPI(UsdPhysics.ArticulationRootAPI):
            continue
        path = str(prim.GetPath())
        if path in bodies:
            found.append(path)
        elif path in by_path:
            joint = by_path[path]
            found.append(joint.child or joint.parent)
        else:
            found += next(([each] for each in bodies if each.startswith(f"{path}/")), [])
    return found


def groups_of(bodies: dict[str, Any], joints: list[StageJoint]) -> list[set[str]]:
    """Return the groups of bodies that joints hold together, each a set of paths; the world joins none."""
    near: dict[str, list[str]] = {path: [] for path in bodies}
    for joint in joints:
        if WORLD not in (joint.parent, joint.child):
            near[joint.parent].append(joint.child)
            near[joint.child].append(joint.parent)
    groups: list[set[str]] = []
    seen: set[str] = set()
    for start in bodies:
        if start in seen:
            continue
        group, todo = {start}, [start]
        while todo:
            fresh = [path for path in near[todo.pop()] if path not in group]
            group.update(fresh)
            todo += fresh
        seen |= group
        groups.append(group)
    return groups


def _leaves_world_open(api: Any, targets: list[Any | None]) -> bool:
    """Return whether a joint to the world itself states no frame there."""
    if targets[0] is None:
        frame = api.GetLocalPos0Attr(), api.GetLocalRot0Attr()
    elif targets[1] is None:
        frame = api.GetLocalPos1Attr(), api.GetLocalRot1Attr()
    else:
        return False
    return not any(attribute.HasAuthoredValue() for attribute in frame)


def _target(opened: OpenStage, relation: Any) -> Any | None:
    """Return the prim that a joint names; None for the world."""
    targets = relation.GetTargets()
    prim = opened.stage.GetPrimAtPath(targets[0].GetPrimPath()) if targets else None
    return prim if prim and not prim.IsPseudoRoot() else None


def _schemas(prim: Any) -> list[str]:
    listed = prim.GetMetadata("apiSchemas")
    return [] if listed is None else [str(name) for name in listed.GetAddedOrExplicitItems()]

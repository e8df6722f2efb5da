"""A USD stage as a robot description: its largest articulation.

| USD | description |
| --- | --- |
| RigidBodyAPI; its frame moved to the anchor of its joint | link |
| joint between bodies; several free axes | joint; a chain with links without mass between |
| the tree that ArticulationRootAPI begins, else the one with most bodies | the robot; others are omitted |
| joint to what is no body | a root link `world`; the body as drawn where no frame is stated there |
| joint outside the articulation, or one that closes a loop | loop joint |
| joint with its bodies the other way round | turned round |
| MassAPI; NewtonMassAPI's tensor; else density and colliders | inertial |
| geometric prims below a body, see `shapes` | visuals and collisions |
| NewtonMimicAPI, PhysxMimicJointAPI, MjcEqualityJointAPI | mimic |
| units and up axis of the stage | m, kg, z up; metres where it states no unit, as physics engines take it |

Schemas of other programs are read by the names of their attributes. Drives, cameras, lights and tendons are
omitted.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.description.files.resolver import Resolver
from roboyard.description.files.usd_layers import reason_of
from roboyard.description.geometry import pose_from_matrix
from roboyard.description.model import Joint, JointType, Link, LoopJoint, Pose, RobotDescription
from roboyard.description.spanning_tree import SpanningTree, spanning_tree
from roboyard.description.urdf.xml import OmittedNote
from roboyard.description.usd.frames import Frames, at_zero
from roboyard.description.usd.graph import (
    WORLD,
    StageJoint,
    groups_of,
    is_body,
    joints_of,
    owner_of,
    roots_of,
)
from roboyard.description.usd.joints import Motion
from roboyard.description.usd.library import Tf
from roboyard.description.usd.masses import inertial_of
from roboyard.description.usd.mimics import mimic_of
from roboyard.description.usd.shapes import BodyShapes, ShapeReader, is_geometry
from roboyard.description.usd.stage import OpenStage, open_stage, quiet
from roboyard.errors import DescriptionError
from roboyard.transforms import Array

MAX_BODIES = 10_000
_NAMED = 5
"""Names that a note lists."""


def read_stage(file: Path, resolver: Resolver | None = None) -> RobotDescription:
    """Read the robot of a USD stage.

    Args:
        file: the stage's root layer, or a package.
        resolver: the folders that it may read; by default those of its own place.

    Returns:
        The description; `notes` lists what it cannot hold. Meshes are files in the user's cache folder.

    Raises:
        DescriptionError: the stage cannot be opened, or has no rigid body.
        MissingExtraError: OpenUSD is not installed.
    """
    try:
        with quiet():
            return _Builder(opened=open_stage(file, resolver, unstated_metres=1.0)).description()
    except DescriptionError as error:
        if error.file is not None:
            raise
        raise DescriptionError(str(error), file=file) from error
    except UnicodeDecodeError as error:
        raise DescriptionError(f"not UTF-8 ({error.reason}); export the stage again", file=file) from None
    except Tf.ErrorException as error:
        raise DescriptionError(f"OpenUSD cannot read it: {reason_of(error)}", file=file) from None


@dataclass(kw_only=True)
class _Builder:
    """One robot."""

    opened: OpenStage
    notes: list[str] = field(default_factory=list)
    names: dict[str, str] = field(default_factory=dict)
    """Path of a body or a joint to its name."""
    taken: set[str] = field(default_factory=set)
    """Names of joints."""
    taken_links: set[str] = field(default_factory=set)
    links: list[Link] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    loops: list[LoopJoint] = field(default_factory=list)
    shifts: dict[str, Array] = field(default_factory=dict)
    """Path of a body to the (4, 4) pose of its link's frame in the body's (m)."""

    def description(self) -> RobotDescription:
        """Return the whole robot."""
        frames = Frames(opened=self.opened)
        bodies = {str(prim.GetPath()): prim for prim in self.opened.prims if is_body(prim)}
        if not bodies:
            raise DescriptionError(
                f"none of the {len(self.opened.prims)} prims is a rigid body; "
                "give a stage with a robot, or open it as a scene"
            )
        if len(bodies) > MAX_BODIES:
            raise DescriptionError(f"{len(bodies)} rigid bodies are too many; give the robot alone")
        joints = joints_of(self.opened, bodies, frames, self.notes.append)
        joints.sort(key=lambda joint: joint.is_loop)  # the tree takes the others first
        tree = self._tree(bodies, joints)
        self._name(tree, bodies, joints)
        self._add_tree(tree, joints, frames)
        for index in tree.loops:
            self._add_loop(joints[index])
        shapes = self._shapes(tree, bodies, frames)
        for path in tree.links:
            self.links.append(self._link(path, bodies, shapes, frames))
        mimics = {
            self.names[path]: mimic
            for stacked in joints
            for joint in (stacked, *stacked.more)
            if (path := str(joint.prim.GetPath())) in self.names
            if (mimic := mimic_of(joint.prim, self._leaders(), self.opened)) is not None
        }
        return RobotDescription(
            name=self._robot_name(),
            links=tuple(self.links),
            joints=tuple(
                replace(joint, mimic=mimics[joint.name]) if joint.name in mimics else joint
                for joint in self.joints
            ),
            loops=tuple(self.loops),
            notes=tuple(map(OmittedNote, dict.fromkeys(self.notes))),
        )

    def _leaders(self) -> dict[str, str]:
        """Return the paths of joints with one motion of their own name."""
        moving = {joint.name for joint in self.joints if joint.is_moving}
        return {path: name for path, name in self.names.items() if name in moving}

    def _tree(self, bodies: dict[str, Any], joints: list[StageJoint]) -> SpanningTree:
        """Return the tree of the largest articulation, else of the largest group of joined bodies."""
        roots = roots_of(self.opened, bodies, joints)
        groups = groups_of(bodies, joints)
        marked = [group for group in groups if any(root in group for root in roots)]
        group = max(marked or groups, key=len)
        edges = [(joint.parent, joint.child) for joint in joints]
        own = [edge for edge in edges if edge[0] in group or edge[1] in group]
        names = [path for path in bodies if path in group]
        if any(WORLD in edge for edge in own):
            names = [WORLD, *names]
        wanted = next((root for root in roots if root in group), "")
        tree = spanning_tree(names, own, world=WORLD, wanted=wanted)
        index = [number for number, edge in enumerate(edges) if edge[0] in group or edge[1] in group]
        others = [_name_of(bodies[path]) for path in bodies if path not in group]
        if others:
            shown = ", ".join(others[:_NAMED]) + (", ..." if len(others) > _NAMED else "")
            self.notes.append(f"{len(others)} bodies that are not joined to the robot are omitted: {shown}")
        return replace(
            tree,
            arriving={path: (index[number], turned) for path, (number, turned) in tree.arriving.items()},
            loops=tuple(index[number] for number in tree.loops),
        )

    def _name(self, tree: SpanningTree, bodies: dict[str, Any], joints: list[StageJoint]) -> None:
        """Name links and joints: as written where the name is free."""
        for path in tree.links:
            wanted = "world" if path == WORLD else _name_of(bodies[path])
            self.names[path] = _free_name(wanted, self.taken_links)
        used = {index for index, _ in tree.arriving.values()} | set(tree.loops)
        for index, joint in enumerate(joints):
            for part in (joint, *joint.more) if index in used else ():
                self.names[str(part.prim.GetPath())] = _free_name(_name_of(part.prim), self.taken)

    def _add_tree(self, tree: SpanningTree, joints: list[StageJoint], frames: Frames) -> None:
        steps = {
            path: _steps(joints[index], turned=turned) for path, (index, turned) in tree.arriving.items()
        }
        for path in tree.links:
            self.shifts[path] = steps[path][-1].shift if path in steps else np.eye(4)
        for path in tree.links:
            if path in steps:
                index, turned = tree.arriving[path]
                self._add_joint(joints[index], steps[path], frames, turned=turned)

    def _add_joint(self, joint: StageJoint, steps: list[_Step], frames: Frames, *, turned: bool) -> None:
        """Add a joint: one, or one for each of its motions, with links between them."""
        above, below = (joint.child, joint.parent) if turned else (joint.parent, joint.child)
        T_above, T_below = (joint.T_child, joint.T_parent) if turned else (joint.T_parent, joint.T_child)
        poses = [self._world_pose(path, frames) for path in (above, below)]
        T_bodies = at_zero(T_above, T_below, np.linalg.inv(poses[0]) @ poses[1])
        parent, T_parent_body = self.names[above], np.linalg.inv(self.shifts[above]) @ T_bodies
        for number, step in enumerate(steps):
            own = self.names[str(step.prim.GetPath())]
            if sum(each.prim == step.prim for each in steps) > 1:
                own = _free_name(f"{own}_{number + 1}", self.taken)
            last = number == len(steps) - 1
            child = self.names[below] if last else self._new_link(f"{own}_link")
            origin = pose_from_matrix(T_parent_body @ step.shift)
            self.joints.append(_joint(own, step, parent, child, origin))
            parent, T_parent_body = child, np.linalg.inv(step.shift)

    def _world_pose(self, path: str, frames: Frames) -> Array:
        prim = self.opened.stage.GetPrimAtPath(path) if path != WORLD else None
        return np.eye(4) if prim is None else frames.rigid(prim)

    def _new_link(self, wanted: str) -> str:
        name = _free_name(wanted, self.taken_links)
        self.links.append(Link(name=name))
        return name

    def _add_loop(self, joint: StageJoint) -> None:
        """Add a joint that closes a loop, if it has as few motions as a loop joint may have."""
        name = self.names[str(joint.prim.GetPath())]
        kinds = ["ball"] if joint.is_point else [motion.kind for motion in joint.motions]
        known = {
            (): "fixed",
            ("turn",): "revolute",
            ("ball",): "spherical",
            ("turn", "turn", "turn"): "spherical",
        }.get(tuple(kinds))
        if known is None:
            self.notes.append(f"joint {name!r} is omitted: it closes a loop and slides")
            return
        axis = joint.motions[0].axis if known == "revolute" else (0.0, 0.0, 1.0)
        ends = ((joint.parent, joint.T_parent), (joint.child, joint.T_child))
        first, second = (pose_from_matrix(np.linalg.inv(self.shifts[path]) @ T) for path, T in ends)
        self.loops.append(
            LoopJoint(
                name=name,
                type=known,  # type: ignore[arg-type]
                first=self.names[joint.parent],
                second=self.names[joint.child],
                first_origin=first,
                second_origin=second,
                axis=axis,
            )
        )

    def _shapes(self, tree: SpanningTree, bodies: dict[str, Any], frames: Frames) -> dict[str, BodyShapes]:
        shapes = {path: BodyShapes() for path in tree.links}
        reader = ShapeReader(frames=frames, notes=self.notes)
        loose = 0
        for prim in self.opened.prims:
            if not is_geometry(prim):
                continue
            owner = owner_of(prim, bodies)
            if owner == WORLD:
                loose += 1
            elif owner in shapes:
                reader.add(shapes[owner], prim, bodies[owner])
        if loose:
            self.notes.append(f"{loose} shapes that belong to no rigid body are omitted")
        return shapes

    def _link(self, path: str, bodies: dict[str, Any], shapes: dict[str, BodyShapes], frames: Frames) -> Link:
        if path == WORLD:
            return Link(name=self.names[path])
        found = shapes[path]
        inertial = inertial_of(bodies[path], found, frames)
        back = np.asarray(np.linalg.inv(self.shifts[path]), dtype=float)
        return Link(
            name=self.names[path],
            inertial=None if inertial is None else replace(inertial, origin=_moved(back, inertial.origin)),
            visuals=tuple(replace(each, origin=_moved(back, each.origin)) for each in found.visuals),
            collisions=tuple(replace(each, origin=_moved(back, each.origin)) for each in found.collisions),
        )

    def _robot_name(self) -> str:
        default = self.opened.stage.GetDefaultPrim()
        return _name_of(default) if default else self.opened.file.stem


@dataclass(frozen=True, kw_only=True, eq=False)
class _Step:
    """One joint of the description."""

    prim: Any
    motion: Motion | None
    """None for a fixed joint."""
    axis: Array
    """(3,) in the child's frame."""
    shift: Array
    """(4, 4) pose of the child link's frame in the body's (m): at the anchor of what turns."""


def _steps(joint: StageJoint, *, turned: bool) -> list[_Step]:
    """Return the motions of a joint and of those stacked on it, from the upper link downwards."""
    steps = []
    for part in (joint, *joint.more):
        T = part.T_parent if turned else part.T_child
        for motion in part.motions or (None,):
            axis = np.array((1.0, 0.0, 0.0) if motion is None else motion.axis)
            shift = np.eye(4)
            if motion is not None and motion.kind != "slide":
                shift[:3, 3] = np.where(np.abs(T[:3, 3]) < 1e-9, 0.0, T[:3, 3])
            axis = T[:3, :3] @ axis * (-1.0 if turned else 1.0)
            steps.append(_Step(prim=part.prim, motion=motion, axis=axis, shift=shift))
    return steps[::-1] if turned else steps


def _moved(back: Array, pose: Pose) -> Pose:
    return pose if not back[:3, 3].any() else pose_from_matrix(back @ pose.matrix())


def _joint(name: str, step: _Step, parent: str, child: str, origin: Pose) -> Joint:
    motion = step.motion
    if motion is None:
        return Joint(name=name, type="fixed", parent=parent, child=child, origin=origin)
    kind: JointType = "spherical"
    if motion.kind == "slide":
        kind = "prismatic"
    elif motion.kind == "turn":
        bounded = motion.limit is not None and motion.limit.lower is not None
        kind = "revolute" if bounded else "continuous"
    x, y, z = (float(value) for value in np.where(np.abs(step.axis) < 1e-9, 0.0, step.axis))
    return Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        origin=origin,
        axis=(x, y, z) if kind != "spherical" else (1.0, 0.0, 0.0),
        limit=motion.limit,
        damping=motion.damping,
        friction=motion.friction,
    )


def _free_name(wanted: str, taken: set[str]) -> str:
    """Return a name that is not taken, and take it."""
    name, number = wanted, 2
    while name in taken:
        name, number = f"{wanted}_{number}", number + 1
    taken.add(name)
    return name


def _name_of(prim: Any) -> str:
    """Return a prim's name, or the one that its writer kept because USD forbids it."""
    kept = prim.GetCustomDataByKey("urdf_name")
    if isinstance(kept, str) and kept.strip():
        return kept
    attribute = prim.GetAttribute("isaac:nameOverride")
    given = attribute.Get() if attribute else None
    shown = prim.GetDisplayName()
    return next(
        (text for text in (given, shown) if isinstance(text, str) and text.strip()), str(prim.GetName())
    )

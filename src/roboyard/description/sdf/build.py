"""An SDF file as a robot description, by way of URDF elements.

| SDF | description |
| --- | --- |
| the model with most links | the robot; what else is in the file is omitted with a note |
| models within it, included ones too; their names as in `arm::wrist` | parts of it |
| link; its frame moved to the anchor of its joint | link |
| `<frame>` | link without shape on a fixed joint |
| revolute, continuous, prismatic, fixed, ball | revolute or continuous, prismatic, fixed, spherical |
| universal, revolute2 | two joints, with a link without mass between them |
| screw | a turning joint, and a sliding one that follows it |
| joint whose child has a parent already | turned round where that makes one tree, else a loop joint |
| `<static>`, joint to the world | a root link `world` |
| `<mimic>` | mimic |
| friction and restitution of collisions | `<contact>` |
| sensors, lights, plugins, settings | `<gazebo>` elements |

Poses, axes and versions follow the SDF specification: `relative_to`, `expressed_in`, `attached_to`,
`placement_frame`, `degrees`; axes in the model's frame before version 1.5.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import field
from pathlib import Path

import numpy as np

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolver
from roboyard.description.sdf.frames import WORLD, Frame, Scope, link_of, pose_of_frame, scopes_of
from roboyard.description.sdf.joints import Ends, Motion, joint_elements, motions_of
from roboyard.description.sdf.links import kept_elements, link_element
from roboyard.description.sdf.models import ModelReader, SdfModel
from roboyard.description.sdf.values import joined, made, origin, pose_of, text_of
from roboyard.description.spanning_tree import SpanningTree, spanning_tree
from roboyard.description.urdf.xml import LocatedElement, OmittedNote, copy_tree, line_of
from roboyard.errors import DescriptionError
from roboyard.transforms import Array

_NAMED = 5
"""Names that a note lists."""
_READ = ("pose", "static", "link", "joint", "frame", "model", "include")


def read_sdf(root: ET.Element, file: Path | None, resolver: Resolver) -> tuple[ET.Element, tuple[str, ...]]:
    """Return an `<sdf>` element as URDF's `<robot>`, and notes on what it does not hold.

    Args:
        root: the parsed file.
        file: None for XML made in memory.
        resolver: finds the models that it includes.

    Raises:
        DescriptionError: it has no model, or the model cannot be used.
    """
    notes: list[str] = []
    try:
        reader = ModelReader(resolver=resolver, note=notes.append)
        models = reader.models_of(root, file)
        if not models:
            reason = next(iter(reader.missing.values()), "give one that has a robot")
            raise DescriptionError(f"the file has no <model>; {reason}", line=line_of(root))
        robot = max(models, key=_links)
        others = [model.name or "?" for model in models if model is not robot]
        if others:
            notes.append(f"models other than {robot.name!r} are omitted: {_listed(others)}")
        built = _Builder(robot=robot, file=file, notes=notes).robot_element()
    except DescriptionError as error:
        if error.file is not None or file is None:
            raise
        raise DescriptionError(str(error), file=file, line=error.line) from error
    return built, tuple(map(OmittedNote, dict.fromkeys(notes)))


def _links(model: SdfModel) -> int:
    count, todo = 0, [model]
    while todo:
        at = todo.pop()
        count += len(at.element.findall("link"))
        todo += at.nested
    return count


def _listed(names: list[str]) -> str:
    shown = ", ".join(name[:60] for name in names[:_NAMED])
    return shown if len(names) <= _NAMED else f"{shown}, ... ({len(names)} in all)"


@dataclass(frozen=True, kw_only=True, eq=False)
class _Edge:
    """A joint between two links."""

    joint: Frame | None
    """None where a static model is fixed to the world."""
    parent: str
    child: str
    motions: list[Motion]


@dataclass(kw_only=True)
class _Builder:
    """One robot."""

    robot: SdfModel
    file: Path | None
    notes: list[str]
    scopes: list[Scope] = field(init=False)
    links: dict[str, Frame] = field(init=False)
    names: set[str] = field(default_factory=set)
    """Of the URDF's links and joints."""

    def robot_element(self) -> ET.Element:
        """Return the whole robot."""
        self.scopes = scopes_of(self.robot)
        self.links = {frame.name: frame for frame in self._frames("link")}
        if not self.links:
            reason = next(iter(self.robot.missing.values()), "give one that has a robot")
            raise DescriptionError(
                f'model "{self.robot.name}" has no <link>; {reason}',
                line=line_of(self.robot.element),
            )
        edges = list(self._edges())
        world = next(name for name in (WORLD, "sdf_world", "sdf_world_") if name not in self.links)
        edges = [_renamed(edge, world) for edge in edges]
        jointed = any(edge.parent == world for edge in edges)
        names = [world, *self.links] if jointed else list(self.links)
        tree = spanning_tree(
            names,
            [(edge.parent, edge.child) for edge in edges],
            world=world,
            wanted=link_of(self.scopes[0].own).name,
        )
        self._note_tree(tree, edges, world)
        self.names = {*names, *(frame.name for frame in self._frames("joint"))}
        return self._element(tree, edges, world)

    def _frames(self, kind: str) -> Iterator[Frame]:
        """Yield the frames of a kind in all models, in file order."""
        for scope in self.scopes:
            if not (scope.model.is_merged and scope.around is not None):
                yield from (frame for frame in scope.frames.values() if frame.kind == kind)

    def _edges(self) -> Iterator[_Edge]:
        """Yield the joints whose links exist, in file order."""
        children: set[str] = set()
        for joint in self._frames("joint"):
            given = [(text_of(joint.element, tag) or "", tag) for tag in ("parent", "child")]
            for name, tag in given:
                if not name:
                    raise DescriptionError(
                        f'joint "{joint.name}" has no <{tag}>; name a link', line=line_of(joint.element)
                    )
            if any(joint.scope.is_missing(name) for name, _ in given):
                self.notes.append(f"joint {joint.name!r} to a model that is not included is omitted")
                continue
            parent, child = (self._end(joint, name) for name, _ in given)
            if parent == child:
                self.notes.append(f"joint {joint.name!r} is omitted: it joins a link to itself")
                continue
            children.add(child)
            yield _Edge(joint=joint, parent=parent, child=child, motions=motions_of(joint, self.notes.append))
        if self.robot.is_static:
            for name in self.links:
                if name not in children:
                    yield _Edge(joint=None, parent="", child=name, motions=[])

    def _end(self, joint: Frame, name: str) -> str:
        """Return the link at one end of a joint; empty for the world."""
        if name == WORLD and WORLD not in joint.scope.frames:
            return ""
        return link_of(joint.scope.find(name, joint.element)).name

    def _note_tree(self, tree: SpanningTree, edges: list[_Edge], world: str) -> None:
        for index in tree.loops:
            joint = edges[index].joint
            if joint is not None and _loop_type(edges[index]) is None:
                self.notes.append(f"joint {joint.name!r} is omitted: it closes a loop and does not only turn")
        others = [name for name in tree.others if name != world]
        if others:
            self.notes.append(f"links that are not joined to the robot are omitted: {_listed(others)}")

    def _element(self, tree: SpanningTree, edges: list[_Edge], world: str) -> ET.Element:
        poses = {name: self._link_pose(name, tree, edges, world) for name in tree.links}
        stem = "robot" if self.file is None else self.file.stem
        robot = made("robot", self.robot.element, name=self.robot.name or stem)
        if tree.root == world:
            robot.append(made("link", self.robot.element, name=world))
        joints: list[LocatedElement] = []
        by_edge = {index: (link, turned) for link, (index, turned) in tree.arriving.items()}
        for index, edge in enumerate(edges):
            if index not in by_edge:
                continue
            link, turned = by_edge[index]
            above = edge.child if turned else edge.parent
            T_parent_child = np.linalg.inv(poses[above]) @ poses[link]
            if edge.joint is None:
                joints.append(self._fixed(f"{link}_fixed", above, link, T_parent_child))
                continue
            ends = Ends(
                parent=above,
                child=link,
                T_parent_child=T_parent_child,
                R_child=poses[link][:3, :3],
                is_turned=turned,
            )
            between, parts = joint_elements(edge.joint, edge.motions, ends, self._free_name)
            robot.extend(between)
            joints.extend(parts)
        kept: list[ET.Element] = []
        for name, link in self.links.items():
            if name in poses:
                is_static = self.robot.is_static
                robot.append(link_element(link, poses[name], self.notes.append, is_static=is_static))
                held = kept_elements(link, poses[name])
                kept += [] if held is None else [held]
        joints += self._add_frames(robot, poses)
        robot.extend(joints)
        robot.extend(self._loop(edges[index], poses) for index in tree.loops if _loop_type(edges[index]))
        robot.extend(kept)
        robot.extend(self._kept())
        return robot

    def _link_pose(self, name: str, tree: SpanningTree, edges: list[_Edge], world: str) -> Array:
        """Return the (4, 4) pose of a URDF link's frame in the model: at the anchor of its joint."""
        if name == world and name not in self.links:
            return np.asarray(np.linalg.inv(pose_of(self.robot.placed)), dtype=float)
        T_model_link = pose_of_frame(self.links[name])
        edge = edges[tree.arriving[name][0]] if name in tree.arriving else None
        if edge is None or edge.joint is None or not edge.motions:
            return T_model_link
        shift = (np.linalg.inv(T_model_link) @ pose_of_frame(edge.joint))[:3, 3]
        moved = np.eye(4)
        moved[:3, 3] = np.where(np.abs(shift) < 1e-12, 0.0, shift)
        return T_model_link @ moved

    def _loop(self, edge: _Edge, poses: dict[str, Array]) -> LocatedElement:
        """Return the `<loop>` of a joint that closes a loop of links."""
        joint, kind = edge.joint, _loop_type(edge)
        assert joint is not None
        assert kind is not None
        element = made("loop", joint.element, name=joint.name, type=kind)
        T_model_joint = pose_of_frame(joint)
        for tag, link in (("predecessor", edge.parent), ("successor", edge.child)):
            end = made(tag, joint.element, link=link)
            end.append(origin(np.linalg.inv(poses[link]) @ T_model_joint))
            element.append(end)
        axis = edge.motions[0].axis if kind == "revolute" else None
        if axis is not None:
            element.append(made("axis", joint.element, xyz=joined(T_model_joint[:3, :3].T @ axis)))
        return element

    def _fixed(self, name: str, parent: str, child: str, T_parent_child: Array) -> LocatedElement:
        element = made("joint", self.robot.element, name=self._free_name(name), type="fixed")
        element.append(origin(T_parent_child))
        element.append(made("parent", self.robot.element, link=parent))
        element.append(made("child", self.robot.element, link=child))
        return element

    def _add_frames(self, robot: ET.Element, poses: dict[str, Array]) -> list[LocatedElement]:
        """Add a link for each `<frame>`; return the joints that hold them."""
        joints = []
        for frame in self._frames("frame"):
            carrier = link_of(frame).name
            if carrier not in poses:
                continue
            name = frame.name if frame.name not in self.names else self._free_name(frame.name)
            self.names.add(name)
            robot.append(made("link", frame.element, name=name))
            T = np.linalg.inv(poses[carrier]) @ pose_of_frame(frame)
            joints.append(self._fixed(f"{name}_fixed", carrier, name, T))
        return joints

    def _kept(self) -> Iterator[ET.Element]:
        """Yield what models and joints hold beside links and joints."""
        for joint in self._frames("joint"):
            sensors = [copy_tree(each) for each in joint.element.findall("sensor")]
            if sensors:
                holder = made("gazebo", joint.element, reference=joint.name)
                holder.extend(sensors)
                yield holder
        for scope in self.scopes:
            model = scope.model
            for child in (*model.element, *model.extra):
                if child.tag not in _READ:
                    holder = made("gazebo", child)
                    holder.append(copy_tree(child))
                    yield holder

    def _free_name(self, wanted: str) -> str:
        """Return a name that no link, joint or frame has, and keep it."""
        name, number = wanted, 2
        while name in self.names:
            name, number = f"{wanted}_{number}", number + 1
        self.names.add(name)
        return name


def _loop_type(edge: _Edge) -> str | None:
    """Return the type of the loop joint that a joint can be; None for one that slides or turns twice."""
    kinds = tuple(motion.type for motion in edge.motions)
    if edge.joint is None or len(kinds) > 1:
        return None
    names = {"revolute": "revolute", "continuous": "revolute", "spherical": "spherical", "fixed": "fixed"}
    return names.get(kinds[0]) if kinds else "fixed"


def _renamed(edge: _Edge, world: str) -> _Edge:
    ends = (edge.parent or world, edge.child or world)
    return _Edge(joint=edge.joint, parent=ends[0], child=ends[1], motions=edge.motions)

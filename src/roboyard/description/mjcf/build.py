"""An MJCF model as a robot description, from what MuJoCo made of it.

| MJCF | description |
| --- | --- |
| body; its frame moved to the anchor of its joint | link |
| hinge, slide, ball; none | revolute or continuous, prismatic, spherical; fixed |
| several joints in one body | a chain of links without mass between them |
| free joint | none: the description's root may float |
| the top-level body with most bodies, and all below it | the robot; what else is in the world is omitted |
| `ref` of a joint | turned back, so that position zero means zero |
| geoms that collide (contype or conaffinity); geoms of groups 0 to 2 | collisions; visuals |
| material with a flat image, of a mesh | colour and texture |
| named site | link without shape on a fixed joint |
| joint's own force range, else the actuators' | effort limit |
| equality of two joints, straight line | mimic |
| connect, weld of two bodies or sites | loop joint, spherical or fixed |

Everything else (tendons, other equalities, sensors, cameras, lights, height fields) is omitted with a note.
"""

from __future__ import annotations

from dataclasses import field, replace
from pathlib import Path
from typing import Any

import numpy as np

from roboyard._records import dataclass
from roboyard.description.geometry import pose_from_matrix
from roboyard.description.mjcf.checked import checked_mjcf
from roboyard.description.mjcf.geoms import ShapeBuilder
from roboyard.description.mjcf.limits import effort_of, mimics_of
from roboyard.description.mjcf.loops import loops_of
from roboyard.description.mjcf.parse import parse_mjcf
from roboyard.description.mjcf.textures import take_textures
from roboyard.description.model import Inertial, Joint, JointType, Limit, Link, RobotDescription
from roboyard.description.urdf.xml import OmittedNote
from roboyard.errors import DescriptionError
from roboyard.transforms import Array, from_wxyz, matrix_from_quaternion

WORLD = "world"
"""Name of the root link of a robot whose first body has a joint to the world."""


def read_mjcf(file: Path) -> RobotDescription:
    """Read an MJCF file.

    Args:
        file: the file; those that it names are in its own folders (see `description.mjcf.checked`).

    Returns:
        The description; `notes` lists everything that it cannot hold.

    Raises:
        DescriptionError: the file is refused, MuJoCo rejects it, or it has no body.
    """
    checked = checked_mjcf(file, pictures=False)
    try:
        spec = parse_mjcf(checked)
        textures = take_textures(spec, file)
        model = spec.compile()
    except Exception as error:  # MuJoCo raises several types
        message = " ".join(str(error).split())[:500]
        raise DescriptionError(f"MuJoCo cannot read it: {message}", file=file) from error
    if model.nbody < 2:
        raise DescriptionError("the model has no <body>; give one that has a robot", file=file)
    return _Builder(model=model, spec=spec, file=file, textures=textures).description()


@dataclass(kw_only=True)
class _Builder:
    """Links and joints so far."""

    model: Any
    spec: Any
    file: Path
    textures: dict[str, Path | None]
    """As `take_textures` returns them."""
    links: list[Link] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    shifts: dict[int, Array] = field(default_factory=dict)
    """Body to the (3,) place of its link frame in the body frame (m)."""

    def description(self) -> RobotDescription:
        """Return the whole model."""
        model = self.model
        shapes = ShapeBuilder(
            model=model, spec=self.spec, file=self.file, textures=self.textures, notes=self.notes
        )
        names = self._names()
        self.shifts[0] = np.zeros(3)
        robot = int(np.bincount(model.body_rootid[1:]).argmax())
        own = [body for body in range(1, model.nbody) if model.body_rootid[body] == robot]
        if len(own) < model.nbody - 1 or model.body_geomnum[0]:
            self.notes.append(f"bodies other than {names[robot]!r} at the top of the world are omitted")
        for body in own:
            self._add_body(body, names, is_root=body == robot)
            visuals, collisions = shapes.of(body, self.shifts[body])
            link = Link(
                name=names[body],
                inertial=self._inertial(body),
                visuals=visuals,
                collisions=collisions,
            )
            self.links.append(link)
        self._add_sites(names)
        self._note_rest()
        mimics = mimics_of(model, self.notes)
        loops = loops_of(model, {body: names[body] for body in own}, self.shifts, self.notes)
        joints = tuple(
            joint if joint.name not in mimics else replace(joint, mimic=mimics[joint.name])
            for joint in self.joints
        )
        name = self.spec.modelname or self.file.stem
        return RobotDescription(
            name=name,
            links=tuple(self.links),
            joints=joints,
            loops=loops,
            notes=tuple(map(OmittedNote, dict.fromkeys(self.notes))),
        )

    def _names(self) -> list[str]:
        found = [self.model.body(b).name for b in range(self.model.nbody)]
        taken = set(found[1:])
        wanted = (WORLD, *(f"{WORLD}{k}" for k in range(len(found))))
        found[0] = next(name for name in wanted if name not in taken)
        return found

    def _add_body(self, body: int, names: list[str], *, is_root: bool) -> None:
        """Add a body's joints, and the links between several of them."""
        model = self.model
        parent = int(model.body_parentid[body])
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        joints = [j for j in range(first, first + count) if model.jnt_type[j] != 0]
        T_parent_body = _matrix(model.body_pos[body], model.body_quat[body])
        T_parent_body[:3, 3] -= self.shifts[parent]
        self.shifts[body] = np.array(model.jnt_pos[joints[-1]]) if joints else np.zeros(3)
        if is_root and not joints:
            return
        above, T_above_body = names[parent], T_parent_body
        if is_root:  # jointed to the world: the world is its root
            self.links.append(Link(name=names[0]))
        if not joints:
            self.joints.append(
                Joint(
                    name=self._free_name(f"{names[body]}_fixed"),
                    type="fixed",
                    parent=above,
                    child=names[body],
                    origin=pose_from_matrix(T_above_body),
                )
            )
        for k, j in enumerate(joints):
            last = k == len(joints) - 1
            child = names[body] if last else self._free_name(f"{names[body]}_{model.joint(j).name}_link")
            anchor, (x, y, z) = np.array(model.jnt_pos[j]), model.jnt_axis[j]
            T_body_child = np.eye(4)
            T_body_child[:3, 3] = anchor
            self.joints.append(
                Joint(
                    name=model.joint(j).name,
                    type=self._type(j),
                    parent=above,
                    child=child,
                    origin=pose_from_matrix(T_above_body @ T_body_child @ self._back(j)),
                    axis=(float(x), float(y), float(z)),
                    limit=self._limit(j),
                    damping=float(model.dof_damping[model.jnt_dofadr[j]].flat[0]),
                    friction=float(model.dof_frictionloss[model.jnt_dofadr[j]]),
                )
            )
            if not last:
                self.links.append(Link(name=child))
            above, T_above_body = child, np.linalg.inv(T_body_child)

    def _type(self, j: int) -> JointType:
        kind = int(self.model.jnt_type[j])
        if kind == 1:
            return "spherical"
        if kind == 2:
            return "prismatic"
        return "revolute" if self.model.jnt_limited[j] else "continuous"

    def _back(self, j: int) -> Array:
        """Return the (4, 4) motion of a joint from the position in which the file draws it to zero."""
        back = np.eye(4)
        ref = float(self.model.qpos0[self.model.jnt_qposadr[j]])
        axis = np.array(self.model.jnt_axis[j])
        if self.model.jnt_type[j] == 2:
            back[:3, 3] = -ref * axis
        elif self.model.jnt_type[j] == 3 and ref:
            x, y, z = np.sin(-ref / 2) * axis
            back[:3, :3] = matrix_from_quaternion((x, y, z, np.cos(ref / 2)))
        return back

    def _limit(self, j: int) -> Limit | None:
        effort = effort_of(self.model, j)
        if not self.model.jnt_limited[j] or self.model.jnt_type[j] == 1:
            return None if effort is None else Limit(effort=effort)
        lower, upper = map(float, self.model.jnt_range[j])
        return Limit(lower=lower, upper=upper, effort=effort)

    def _inertial(self, body: int) -> Inertial | None:
        model = self.model
        if not model.body_mass[body] > 0:
            return None
        x, y, z = map(float, model.body_inertia[body])
        T = _matrix(model.body_ipos[body] - self.shifts[body], model.body_iquat[body])
        return Inertial(
            mass=float(model.body_mass[body]), origin=pose_from_matrix(T), inertia=(x, 0.0, 0.0, y, 0.0, z)
        )

    def _add_sites(self, names: list[str]) -> None:
        model = self.model
        present = {link.name for link in self.links}
        for s in range(model.nsite):
            name, body = model.site(s).name, int(model.site_bodyid[s])
            if not name or body == 0 or names[body] not in present:
                continue
            link = self._free_name(name)
            self.links.append(Link(name=link))
            T = _matrix(model.site_pos[s] - self.shifts[body], model.site_quat[s])
            self.joints.append(
                Joint(
                    name=self._free_name(f"{link}_fixed"),
                    type="fixed",
                    parent=names[body],
                    child=link,
                    origin=pose_from_matrix(T),
                )
            )

    def _free_name(self, wanted: str) -> str:
        """Return a name that no link, joint or body has."""
        taken = {link.name for link in self.links} | {joint.name for joint in self.joints}
        taken |= {self.model.body(b).name for b in range(self.model.nbody)}
        taken |= {self.model.joint(j).name for j in range(self.model.njnt)}
        name, number = wanted, 2
        while name in taken:
            name, number = f"{wanted}_{number}", number + 1
        return name

    def _note_rest(self) -> None:
        """Note what the description does not hold."""
        model = self.model
        for count, what in (
            (model.ntendon, "tendons"),
            (model.ncam, "cameras"),
            (model.nsensor, "sensors"),
            (model.nflex, "flexible bodies"),
            (model.nskin, "skins"),
        ):
            if count:
                self.notes.append(f"{count} {what} are omitted: a robot description has none")


def _matrix(position: Array, quaternion: Array) -> Array:
    """Return the (4, 4) pose of MuJoCo's position and quaternion w, x, y, z."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = matrix_from_quaternion(from_wxyz(quaternion)), position
    return pose

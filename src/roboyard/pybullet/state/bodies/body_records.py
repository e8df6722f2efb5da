"""The record of each body beside the World's own state: ids, joint info, contact and damping settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from roboyard._records import NamedTuple, dataclass
from roboyard.description.model import Pose
from roboyard.pybullet.bullet_rules.models import BodyModel
from roboyard.pybullet.bullet_rules.motor_commands import MotorCommands
from roboyard.pybullet.bullet_rules.single_precision import matrix_signed
from roboyard.pybullet.state.bodies.body_shapes import BodyShapes
from roboyard.pybullet.state.bodies.joint_tables import (
    POSITION_COUNT,
    VELOCITY_COUNT,
    JointLayout,
    joint_infos,
    joint_layout,
)
from roboyard.transforms import Array, conjugate, multiply, rotate

if TYPE_CHECKING:
    from roboyard.kinematics import ChainArrays
    from roboyard.pybullet.bullet_rules.link_trees import LinkTree
    from roboyard.pybullet.face.arguments import Vector3
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link
    from roboyard.sim.pool.lone_bodies import LoneBody
    from roboyard.sim.soft.soft_body import SoftBody
    from roboyard.sim.world import World

DEFAULT_FRICTION = 0.5
CONTACT_STIFFNESS, CONTACT_DAMPING = 1e4, 1.0
"""Contact stiffness (N/m) and damping (N s/m) of a description that gives only the other."""
DEFAULT_DAMPING = 0.03999999910593033
"""Bullet's 0.04, a number of single precision: bodies fall as there to the last bit."""
DEFAULT_IMPULSE = {0: 1.0, 1: 1.0, 2: 1000.0}
"""Largest impulse per step of the default motor of a joint, by joint type (N m s or N s)."""
_FEW = 4
"""Most shapes of a body that is compared with others by its numbers."""
MULTIBODY, RIGID_BODY = 2, 1
_ALONE = -2
"""Revision of no World, nor of none."""
HIDDEN_JOINT = -1
"""Type of a joint that scripts cannot access; it has no motor."""


class Side(NamedTuple):
    """Some collision shapes of a body."""

    places: list[tuple[int, int, int]]
    """Body, link and MuJoCo geom of each."""
    geoms: np.ndarray
    """(k,) MuJoCo's geoms."""


NO_SIDE = Side([], np.zeros(0, np.int64))

LinkReader = Callable[[int, object, bool], tuple[Any, ...]]
"""`read(link, with_velocity, is_fresh)`: the fields of getLinkState."""

MovedLinkReader = Callable[[int, object, bool], tuple[Any, ...]]
"""`read(link, with_velocity, is_fresh)`: the fields of getLinkState in the present state."""


LinkPusher = Callable[..., bool]
"""`push(link, local, (fx, fy, ..., pz))`: whether the numbers are finite; see `push_link`."""


class JointGroup(Protocol):
    """Joints of one body that are read together."""

    joints: tuple[int, ...]
    """Joint indices."""
    is_scalar: bool
    """Whether every joint has at most one degree of freedom."""
    is_free: bool
    """Whether every joint has exactly one."""

    def read(self, record: BodyRecord, forces: Array) -> tuple[tuple[Any, ...], ...]:
        """Return the fields of getJointState of each joint; `forces`: (nv,) motor efforts (N m or N)."""
        ...

    def read_tuples(self, record: BodyRecord, forces: Array) -> tuple[tuple[Any, ...], ...]:
        """Return the fields of getJointStateMultiDof of each joint, if `is_free`; `forces` (nv,) as above."""
        ...

    def write(
        self, record: BodyRecord, positions: Sequence[float], velocities: Sequence[float] | None = None
    ) -> None:
        """Put the joints at (n,) positions (rad or m), at rest or with (n,) speeds, if `is_free`."""
        ...


class LinkGroup(Protocol):
    """Links of one body that are read together."""

    def read(self, with_velocity: object, is_fresh: bool) -> tuple[tuple[Any, ...], ...]:
        """Return the fields of getLinkState of each link."""
        ...


class LinkBoxes(Protocol):
    """Boxes around the shapes of one body's links in the world."""

    @property
    def arrays(self) -> tuple[Array, Array, np.ndarray]:
        """(n, 7) inertial frames in link frames, (n, 8) boxes in these, and (n,) MuJoCo's rows of links."""
        ...

    def read(self, link: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the two (3,) corners of a link's box (m)."""
        ...


class SceneBoxes(Protocol):
    """Boxes around the shapes of all links of a scene."""

    def inside(self, low: Vector3, high: Vector3, margin: float) -> tuple[tuple[int, int], ...]:
        """Return body and link of those whose boxes overlap one with (3,) corners, larger by a margin (m)."""
        ...


@dataclass(kw_only=True, slots=True)
class LinkState:
    """Settings of one link (or the base) that scripts read back and change."""

    mass: float
    """Mass (kg)."""
    moments: tuple[float, float, float]
    """Moments of inertia about the inertial frame's axes (kg m²)."""
    frame: Pose
    """Inertial frame in the link frame."""
    friction: float = DEFAULT_FRICTION
    """Lateral friction coefficient."""
    rolling_friction: float = 0.0
    """Rolling friction coefficient."""
    spinning_friction: float = 0.0
    """Spinning friction coefficient."""
    restitution: float = 0.0
    """Restitution (0 to 1)."""
    contact_damping: float = -1.0
    """Contact damping; -1: not set."""
    contact_stiffness: float = -1.0
    """Contact stiffness; -1: not set."""
    is_anchored: bool = False
    """Whether friction pulls contacts back to where they began."""
    joint_damping: float | None = None
    """Damping of the joint set by a script (N m s/rad or N s/m)."""
    lower_limit: float | None = None
    """Lower limit of the joint set by a script (rad or m)."""
    upper_limit: float | None = None
    """Upper limit of the joint set by a script (rad or m)."""
    collision_margin: float | None = None
    """Collision margin set by a script (m)."""
    solid_mass: Any = None
    """Mass (kg) where the moments are known to be those of the shapes; else no number."""


class BodyRecord:
    """One body of a client. Link indices are those of scripts: -1 for the base, then the joint index."""

    def __init__(
        self, number: int, model: BodyModel, body: Body, *, file: str = "", kind: int = MULTIBODY
    ) -> None:
        """Create the record of a new body.

        Args:
            number: body id.
            model: masses, links and joints as Bullet has them.
            body: body in the World.
            file: file that it was loaded from.
            kind: MULTIBODY or RIGID_BODY.
        """
        self.number = number
        self.model = model
        self.body = body
        self.file = file
        self.folder: str | None = None
        """Folder of the file as the script gave it; None where a search path or a link led to the file."""
        self.kind = kind
        self.infos: Sequence[tuple[Any, ...]] = model.once("infos", joint_infos) if kind == MULTIBODY else ()
        """The fields of getJointInfo; empty for rigid bodies, whose joints are hidden, as in PyBullet."""
        self.joint_count = len(self.infos)
        self.dof_count = _dof_count(self.infos)
        """As computeDofCount has it."""
        self.links = [LinkState(**fields) for fields in model.once("links", _link_fields)]
        self.shapes = BodyShapes(model, self.links, body, at_inertial=kind != MULTIBODY)
        """Its shapes as Bullet has them."""
        self.held: dict[int, float] = {}
        """Inertia of the motors of joints that are held because nothing beyond them has mass or inertia."""
        self.collision_rows: dict[int, tuple[tuple[Any, ...], ...]] = {}
        """The fields of getCollisionShapeData by link, once they were asked for."""
        self.linear_damping = self.angular_damping = DEFAULT_DAMPING
        self.velocity_limit: float | None = None
        """Largest velocity of the joints set by a script (rad/s or m/s)."""
        self.chains: dict[tuple[int, ...], ChainArrays] = {}
        """Kinematic chains for inverse kinematics, by the links that have targets."""
        self.chain_places: Any = None
        """Indices of the positions of all movable joints in qpos."""
        self.is_scalar = [info[2] in (0, 1) for info in self.infos]
        """Whether each joint has one degree of freedom."""
        self.colors: dict[int, tuple[float, ...]] = {}
        """Colours set by changeVisualShape, by link; 0 is the base."""
        self.sensors: set[int] = set()
        """Joints with a force-torque sensor."""
        self.applied: list[Any] = [_zero_effort(info[2]) for info in self.infos]
        """Torque (N m) or force (N) of each motor in the last step in which it was on."""
        self.reactions: dict[int, tuple[float, ...]] = {}
        """Reaction in joints with a sensor in the last step, once the world has changed since."""
        self.motored = [info[2] in DEFAULT_IMPULSE for info in self.infos]
        """Whether each joint's motor is on."""
        self.motors_off: set[int] = set()
        """Joints whose motor was switched off by a script."""
        self.joint_groups: dict[tuple[int, ...], JointGroup] = {}
        """Joints that are read together, by joint indices."""
        self.link_groups: dict[tuple[int, ...], LinkGroup] = {}
        """Links that are read together, by link indices."""
        self.motor_commands: MotorCommands | None = None
        """Fast motor commands of this body, created when a script uses them."""
        self.soft: SoftBody | None = None
        """The nodes of a soft body."""
        self.placed: tuple[Any, Any] | None = None
        """Pose of the inertial frame where a script put a fixed base last; None where others moved it."""
        self.first_pose: tuple[float, ...] | None = None
        """Position and quaternion (7,) of the base link frame when it was loaded."""
        self.fixed_poses: Any = None
        """Poses of the inertial and the link frame of a fixed base, once they were asked for."""
        self.fixed_axes: tuple[Any, Array] | None = None
        """Quaternion of the inertial frame of a fixed base and its (3, 3) rotation, once it was asked for."""
        self.shown = np.array([-1.0])
        """`SceneBodies.step_count` when its links were last shown where they are."""
        self.revision = -1
        self._data: Any = None
        """MjData, or the body alone, whose arrays are looked up."""
        self.link_reader: LinkReader | None = None
        self.moved_link_reader: MovedLinkReader | None = None
        """Reads a link's state; created on first use."""
        self.reaction_reader: Any = None
        """Reads reactions in joints; created on first use."""
        self.link_pusher: LinkPusher | None = None
        """Pushes a link; created on first use."""
        self.link_boxes: LinkBoxes | None = None
        """Boxes around links; created on first use."""
        self.sides: dict[int, Side] | None = None
        """Collision shapes of links, and of all under `contacts.ANY_LINK`; looked up on first use."""
        self._layout: JointLayout | None = None
        self._tree: LinkTree | None = None
        self._has_tree = True
        self.rows: list[int] = []
        """MuJoCo row of the base, then of each link."""
        self.free: Array | None = None
        """View of the free joint's (7,) numbers in qpos; None for a fixed base."""
        self.free_velocity: Array | None = None
        self.words: tuple[Any, Any] = (memoryview(b""), memoryview(b""))
        """The memory of qpos and qvel."""
        self.base_bytes = self.base_speed_bytes = -1
        """Where the numbers of the free joint begin in it; -1 for a fixed base."""
        self.position_addresses: list[int] = []
        self.velocity_addresses: list[int] = []
        self.qpos = self.qvel = np.zeros(0)
        self.loaded_fixed = model.fixed_base
        """Whether the base was fixed when it was loaded (a new mass can free it)."""
        self.base_frame = model.links[0].frame
        self.base_is_plain = self.base_frame.is_identity

    @property
    def name(self) -> str:
        """Name of the body."""
        return self.model.name

    def link(self, index: int) -> Link | None:
        """Return the World's link for a link index (-1: the base), or None."""
        return self.body.links[index + 1] if -1 <= index < self.joint_count else None

    def joint_type(self, joint: int) -> int:
        """Return the type of a joint (JOINT_REVOLUTE, ...), or HIDDEN_JOINT."""
        return self.infos[joint][2] if joint < self.joint_count else HIDDEN_JOINT

    def rename_joints(self, names: Mapping[int, bytes]) -> None:
        """Give joints, by index, other names than those of the model."""
        self.infos = [(info[0], names.get(info[0], info[1]), *info[2:]) for info in self.infos]

    def movable(self) -> list[int]:
        """Return the joints of one degree of freedom or more, in order."""
        return [info[0] for info in self.infos if POSITION_COUNT[info[2]]]

    def base_pose(self) -> tuple[Sequence[float], Sequence[float]]:
        """Return position (m) and orientation (x, y, z, w) of the base's link frame in the world."""
        if self.fixed_poses is not None:
            return self.fixed_poses[1]
        if self.free is not None:
            x, y, z, w, i, j, k = self.free.tolist()
            return (x, y, z), (i, j, k, w)
        position, orientation = self.body.pose
        return position.tolist(), orientation.tolist()

    def refresh(self, world: World) -> None:
        """Update the indices of this body in the World's arrays."""
        body, data = self.body, world.live_data
        self.revision = world.revision
        self.fixed_poses = None
        if self._data is not data:  # a body keeps its rows as long as MuJoCo's arrays are the same
            rows, positions, velocities = body.mujoco_ids, body.qpos_addresses, body.dof_addresses
            self._look_up(data, rows.tolist(), positions.tolist(), velocities.tolist())
            self._look_up_base(body.free_qpos, body.free_dof)

    def refresh_alone(self, lone: LoneBody) -> None:
        """Update the indices of this body, which the World has no rows of yet, in arrays of it alone."""
        self.revision = _ALONE
        self.fixed_poses = None
        tree = lone.tree
        if self._data is not lone:
            self._look_up(lone, tree.rows, tree.positions, tree.velocities)
            self._look_up_base(*(0, 0) if tree.is_free else (-1, -1))

    def _look_up(
        self, data: Any, rows: Iterable[int], positions: Iterable[int], velocities: Iterable[int]
    ) -> None:
        self._data = data
        self.joint_groups.clear()
        self.link_groups.clear()
        self.chain_places = None
        self.link_reader = self.moved_link_reader = self.link_pusher = self.link_boxes = self.sides = None
        self.reaction_reader = None
        self._layout = self._tree = None
        self._has_tree = True
        self.rows = list(rows)
        self.qpos, self.qvel = data.qpos, data.qvel
        self.words = self.qpos.data, self.qvel.data
        self.position_addresses, self.velocity_addresses = list(positions), list(velocities)

    def _look_up_base(self, position: int, velocity: int) -> None:
        self.base_bytes, self.base_speed_bytes = 8 * position, 8 * velocity
        if position >= 0:
            self.free = self.qpos[position : position + 7]
            self.free_velocity = self.qvel[velocity : velocity + 6]
        else:
            self.free = self.free_velocity = None

    def to_inertial(self, position: Array, quaternion: Array, link: int = -1) -> tuple[Array, Array]:
        """Return (3,) position and (4,) quaternion of a link's inertial frame from its link frame."""
        frame = self.links[link + 1].frame
        return position + rotate(quaternion, frame.position), multiply(quaternion, frame.quaternion)

    def from_inertial(self, position: Array, quaternion: Array, link: int = -1) -> tuple[Array, Array]:
        """Return the (3,) position and (4,) quaternion of a link frame from those of its inertial frame."""
        frame = self.links[link + 1].frame
        turned = multiply(quaternion, conjugate(frame.quaternion))
        return np.asarray(position) - rotate(turned, frame.position), turned

    @property
    def layout(self) -> JointLayout:
        """Where the joints are in the World's arrays as they are now."""
        if self._layout is None:
            self._layout = joint_layout(self.infos, self.position_addresses, self.velocity_addresses)
        return self._layout

    def tree(self, model: Any) -> LinkTree | None:
        """Return the compiled dynamics of the body in MuJoCo's model; None where its joints have none."""
        if self._tree is None and self._has_tree and (self.free is None or not self.loaded_fixed):
            from roboyard.pybullet.bullet_rules.link_trees import link_tree

            types = [info[2] for info in self.infos]
            self._tree = link_tree(model, self.rows, types, self.base_frame, self.free)
            self._has_tree = self._tree is not None
        return self._tree

    def keep_applied(self, forces: Sequence[float]) -> None:
        """Note the efforts of all motors that are on, from those (nv,) of all joints (N m or N)."""
        applied, starts, infos = self.applied, self.velocity_addresses, self.infos
        for joint, is_on in enumerate(self.motored):
            if is_on:
                start, count = starts[joint], VELOCITY_COUNT[infos[joint][2]]
                applied[joint] = (
                    forces[start] if count == 1 else tuple(forces[k] for k in range(start, start + count))
                )

    def positions_of(self, joint: int) -> slice:
        """Return the slice of a joint in qpos."""
        start = self.position_addresses[joint]
        return slice(start, start + POSITION_COUNT[self.joint_type(joint)])

    def velocities_of(self, joint: int) -> slice:
        """Return the slice of a joint in qvel."""
        start = self.velocity_addresses[joint]
        return slice(start, start + VELOCITY_COUNT[self.joint_type(joint)])


def side_of(places: Iterable[tuple[int, int, int]]) -> Side:
    """Return collision shapes as a side of a query, from body, link and MuJoCo geom of each."""
    found = list(places)
    return Side(found, np.array([place[2] for place in found], np.int64))


def _link_fields(model: BodyModel) -> list[dict[str, Any]]:
    """Return the fields of each link's `LinkState`."""
    return [
        {"mass": link.mass, "moments": link.moments, "frame": _shown(link.frame), **_contact_of(model, index)}
        for index, link in enumerate(model.links)
    ]


def _contact_of(model: BodyModel, index: int) -> dict[str, Any]:
    """Return the contact settings of a link in the description."""
    link = model.description.links[index]
    contact = link.contact
    if contact is None:
        return {}
    given: dict[str, Any] = {
        "is_anchored": any(e.tag == "contact" and e.find("friction_anchor") is not None for e in link.extra),
        "friction": contact.lateral_friction,
        "rolling_friction": contact.rolling_friction,
        "spinning_friction": contact.spinning_friction,
        "restitution": contact.restitution,
    }
    if contact.stiffness is not None or contact.damping is not None:
        given["contact_stiffness"] = CONTACT_STIFFNESS if contact.stiffness is None else contact.stiffness
        given["contact_damping"] = CONTACT_DAMPING if contact.damping is None else contact.damping
    return {name: value for name, value in given.items() if value is not None}


def _renamed(info: tuple[Any, ...], names: Mapping[str, str]) -> tuple[Any, ...]:
    """Return the fields of getJointInfo with another name, if there is one."""
    new = names.get(info[1].decode())
    return info if new is None else (info[0], new.encode(), *info[2:])


def _zero_effort(kind: int) -> Any:
    return (0.0,) * max(1, VELOCITY_COUNT[kind]) if VELOCITY_COUNT[kind] > 1 else 0.0


def _shown(frame: Pose) -> Pose:
    """Return an inertial frame with the sign that Bullet shows of its quaternion."""
    if frame.quaternion[3] > 0.5:
        return frame
    return Pose(position=frame.position, quaternion=matrix_signed(*frame.quaternion))


def _dof_count(infos: Sequence[tuple[Any, ...]]) -> int:
    """Return the number of hinges and slides, -1 or -2 if a spherical or planar joint comes, as in Bullet."""
    count = 0
    for info in infos:
        if info[2] in _NO_COUNT:
            return _NO_COUNT[info[2]]
        count += VELOCITY_COUNT[info[2]]
    return count


_NO_COUNT = {2: -1, 3: -2}
"""Types of joints that Bullet does not count, and what it gives instead."""

"""What the face keeps for each body beside the World's own: ids, joint tables, contact and damping
settings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from roboyard.description.model import Pose
from roboyard.pybullet.bullet_rules.models import BodyModel
from roboyard.pybullet.bullet_rules.motor_commands import MotorCommands
from roboyard.pybullet.state.joint_tables import POSITION_COUNT, VELOCITY_COUNT, joint_infos
from roboyard.transforms import Array, conjugate, from_wxyz, multiply, rotate

if TYPE_CHECKING:
    from roboyard.kinematics import ChainArrays
    from roboyard.pybullet.bullet_rules.shape_bounds import LinkBounds
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link
    from roboyard.sim.world import World

DEFAULT_FRICTION = 0.5
DEFAULT_DAMPING = 0.04
DEFAULT_IMPULSE = {0: 1.0, 1: 1.0, 2: 1000.0}
"""Of the motors that joints have from the start, by joint type: N m s or N s in a step."""
MULTIBODY, RIGID_BODY = 2, 1
UNSEEN = -1
"""Type of a joint that scripts do not see: it has no motor."""


LinkReader = Callable[[int, object], tuple[Any, ...]]
"""`read(link, with_velocity)`: the fields of getLinkState."""


class JointGroup(Protocol):
    """Joints of one body that are read together."""

    joints: tuple[int, ...]
    is_scalar: bool

    def read(self, record: BodyRecord, forces: Array) -> tuple[tuple[Any, ...], ...]:
        """Return the fields of getJointState of each joint; `forces`: (nv,) motor efforts (N m or N)."""
        ...


class LinkGroup(Protocol):
    """Links of one body that are read together."""

    def read(self) -> tuple[tuple[Any, ...], ...]:
        """Return the fields of getLinkState of each link, without velocities."""
        ...


@dataclass(kw_only=True, slots=True)
class LinkState:
    """Settings of one link (or the base) that scripts read back and change."""

    mass: float
    moments: tuple[float, float, float]
    frame: Pose
    friction: float = DEFAULT_FRICTION
    rolling_friction: float = 0.0
    spinning_friction: float = 0.0
    restitution: float = 0.0
    contact_damping: float = -1.0
    contact_stiffness: float = -1.0
    collision_margin: float | None = None
    """m, where a script has changed it."""


class BodyRecord:
    """One body of a client. Links count as scripts do: -1 for the base, then as the joints."""

    def __init__(
        self, number: int, model: BodyModel, body: Body, *, file: str = "", kind: int = MULTIBODY
    ) -> None:
        self.number = number
        self.model = model
        self.body = body
        self.file = file
        self.kind = kind
        self.infos = joint_infos(model) if kind == MULTIBODY else ()
        """Of getJointInfo; scripts do not see the joints of what is made of rigid bodies, as in PyBullet."""
        self.joint_count = len(self.infos)
        self.links = [
            LinkState(mass=link.mass, moments=link.moments, frame=link.frame, **_contact_of(model, i))
            for i, link in enumerate(model.links)
        ]
        self._bounds: dict[int, LinkBounds] = {}
        self.linear_damping = self.angular_damping = DEFAULT_DAMPING
        self.chains: dict[tuple[int, ...], ChainArrays] = {}
        """For inverse kinematics, by the links that have targets."""
        self.chain_places: Any = None
        """Where the positions of all movable joints lie."""
        self.is_scalar = [info[2] in (0, 1) for info in self.infos]
        """Joints of one degree of freedom."""
        self.colors: dict[int, tuple[float, ...]] = {}
        """What changeVisualShape said of a link, the base being 0."""
        self.sensors: set[int] = set()
        """Joints whose force and torque are measured."""
        self.applied: list[Any] = [_nothing(info[2]) for info in self.infos]
        """What each joint's motor applied in the last step in which it was on."""
        self.motored = [info[2] in DEFAULT_IMPULSE for info in self.infos]
        """Joints whose motor is on."""
        self.motors_off: set[int] = set()
        """Joints whose motor was switched off."""
        self.joint_groups: dict[tuple[int, ...], JointGroup] = {}
        """Joints that are read together, by their indices."""
        self.link_groups: dict[tuple[int, ...], LinkGroup] = {}
        """Links that are read together, by their indices."""
        self.motor_commands: MotorCommands | None = None
        """The World's motors of this body and where each joint's is, once a script uses them."""
        self.fixed_pose: Any = None
        """Of the base's inertial frame, while it is known not to have moved."""
        self.revision = -1
        self.link_reader: LinkReader | None = None
        """Reads a link's state, once somebody has asked for one."""
        self.rows: list[int] = []
        """MuJoCo row of the base, then of each link."""
        self.free: Array | None = None
        """View of the free joint's seven numbers in qpos; None for a fixed base."""
        self.free_velocity: Array | None = None
        self.position_addresses: list[int] = []
        self.velocity_addresses: list[int] = []
        self.qpos = self.qvel = np.zeros(0)
        self.loaded_fixed = model.fixed_base
        """Whether the base could not move at first (a new mass lets it go)."""
        self.base_frame = model.links[0].frame
        self.base_is_plain = _is_identity(self.base_frame)

    @property
    def name(self) -> str:
        return self.model.name

    def link(self, index: int) -> Link | None:
        """Return the World's link for a link index (-1: the base), or None."""
        return self.body.links[index + 1] if -1 <= index < self.joint_count else None

    def joint_type(self, joint: int) -> int:
        return self.infos[joint][2] if joint < self.joint_count else UNSEEN

    def bounds(self, link: int) -> tuple[LinkBounds, float]:
        """Box of a link's shapes and the margin (m) that it has now."""
        found = self._bounds.get(link)
        if found is None:
            model = self.model.links[link + 1]
            found = self._bounds[link] = self.model.bounds_of(self.links[link + 1].frame, model.collisions)
        changed = self.links[link + 1].collision_margin
        return found, found.margin if changed is None or found.is_round else changed

    def movable(self) -> list[int]:
        """Joints of one degree of freedom or more, in order."""
        return [info[0] for info in self.infos if POSITION_COUNT[info[2]]]

    def refresh(self, world: World) -> None:
        """Look up where this body lies in the World's arrays."""
        body, data = self.body, world.live_data
        self.revision = world.revision
        self.fixed_pose = None
        self.joint_groups.clear()
        self.link_groups.clear()
        self.chain_places = None
        self.link_reader = None
        self.rows = [int(row) for row in body.mujoco_ids]
        self.qpos, self.qvel = data.qpos, data.qvel
        self.position_addresses = [int(a) for a in body.qpos_addresses]
        self.velocity_addresses = [int(a) for a in body.dof_addresses]
        if body.free_qpos >= 0:
            self.free = data.qpos[body.free_qpos : body.free_qpos + 7]
            self.free_velocity = data.qvel[body.free_dof : body.free_dof + 6]
        else:
            self.free = self.free_velocity = None

    def to_inertial(self, position: Array, quaternion: Array, link: int = -1) -> tuple[Array, Array]:
        """Pose of a link's inertial frame from that of its link frame."""
        frame = self.links[link + 1].frame
        return position + rotate(quaternion, frame.position), multiply(quaternion, frame.quaternion)

    def from_inertial(self, position: Array, quaternion: Array, link: int = -1) -> tuple[Array, Array]:
        """Pose of a link frame from that of the link's inertial frame."""
        frame = self.links[link + 1].frame
        turned = multiply(quaternion, conjugate(frame.quaternion))
        return np.asarray(position) - rotate(turned, frame.position), turned

    def positions_of(self, joint: int) -> slice:
        start = self.position_addresses[joint]
        return slice(start, start + POSITION_COUNT[self.joint_type(joint)])

    def velocities_of(self, joint: int) -> slice:
        start = self.velocity_addresses[joint]
        return slice(start, start + VELOCITY_COUNT[self.joint_type(joint)])


def _contact_of(model: BodyModel, index: int) -> dict[str, float]:
    """Contact settings that the description gives a link."""
    link = model.description.links[index]
    contact = link.contact
    if contact is None:
        return {}
    given = {
        "friction": contact.lateral_friction,
        "rolling_friction": contact.rolling_friction,
        "spinning_friction": contact.spinning_friction,
        "restitution": contact.restitution,
        "contact_damping": contact.damping,
        "contact_stiffness": contact.stiffness,
    }
    return {name: value for name, value in given.items() if value is not None}


def _nothing(kind: int) -> Any:
    return (0.0,) * max(1, VELOCITY_COUNT[kind]) if VELOCITY_COUNT[kind] > 1 else 0.0


def _is_identity(pose: Pose) -> bool:
    return tuple(pose.position) == (0.0, 0.0, 0.0) and tuple(pose.quaternion) == (0.0, 0.0, 0.0, 1.0)


def pose_of_qpos(free: Array) -> tuple[Array, Array]:
    """Position and x, y, z, w of a free joint's seven numbers."""
    return free[:3].copy(), from_wxyz(free[3:])

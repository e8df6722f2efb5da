"""A table before a robot's arm, where the arm can reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.envs.tasks.reachable import reachable, ready_posture
from roboyard.errors import ConfigError
from roboyard.kinematics import from_description, solve_ik
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import Array, conjugate, multiply, rotate

THICKNESS = 0.04
"""Of the table's top (m)."""
CLEAR = 0.12
"""Between the shoulder and the near edge of the table (m)."""
TILTS = (0.0, 0.5, 0.9, 1.2)
"""Angles between straight down and the way an end effector points at a table, tried in this order (rad)."""
POINTING: tuple[tuple[float, float, float, float], ...] = tuple(
    (float(np.cos(tilt / 2)), 0.0, float(np.sin(tilt / 2)), 0.0)
    if side
    else (0.0, float(np.cos(tilt / 2)), 0.0, float(np.sin(tilt / 2)))
    for tilt in TILTS
    for side in (True, False)
)
"""Orientations x, y, z, w: z down and ahead, y (from finger to finger) to the right or to the left."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Table:
    """The part of a table's top that an arm reaches."""

    centre: tuple[float, float] = (0.0, 0.0)
    """x, y of its middle in the world frame (m)."""
    height: float = 0.0
    """Of the top (m)."""
    half: float = 0.15
    """Half of its edge (m)."""
    quaternion: tuple[float, float, float, float] | None = None
    """Orientation x, y, z, w of the end effector above it; None where any will do."""

    def at(self, x: float, y: float, above: float = 0.0) -> tuple[float, float, float]:
        """Return the point at shares x, y from -1 to 1 of the part, `above` its top (m)."""
        return (
            self.centre[0] + x * self.half,
            self.centre[1] + y * self.half,
            self.height + above,
        )

    def points(self, shares: Array, above: float) -> Array:
        """Return (k, 3) points (m) of (k, 2) shares from -1 to 1."""
        out = np.empty((len(shares), 3))
        out[:, :2] = np.asarray(self.centre) + self.half * shares
        out[:, 2] = self.height + above
        return out


def place_table(world: World, robot: Robot, arm: str, *, points: bool = False) -> tuple[Table, Body]:
    """Add a table in front of an arm, where `find_table` finds a place for it.

    Args:
        world: of the robot.
        robot: with the arm; it is left in a dexterous posture.
        arm: its name.
        points: the end effector is to point at the table, best straight down.
    """
    table = find_table(robot, arm, points=points)
    return table, _add_table(world, table)


def find_table(robot: Robot, arm: str, *, points: bool = False) -> Table:
    """Return a place in front of an arm, at a height and distance that it reaches well.

    Args:
        robot: with the arm; it is left in a dexterous posture.
        arm: its name.
        points: the end effector is to point at the table, best straight down.

    Raises:
        ConfigError: the arm reaches no table in front of the robot.
    """
    found = reachable(robot, arm, 200)
    robot.joint_positions = ready_posture(robot, found, arm)
    manipulation = robot.manipulation
    assert manipulation is not None
    shoulder = robot.joint(robot.joint_names[manipulation.arm_control_idx[arm][0]]).child.pose[0]
    floor = robot.base_link.pose[0][2]
    longest = float(np.linalg.norm(found.tips - shoulder, axis=1).max())
    for half in (0.2, 0.15, 0.1, 0.06):
        for drop in (0.35, 0.2, 0.5, 0.05, 0.65):
            height = float(np.clip(shoulder[2] - drop * longest, floor + 0.08, 0.95))
            for away in (0.45, 0.55, 0.38, 0.65):
                x = max(shoulder[0] + away * longest, shoulder[0] + CLEAR + half)
                for quaternion in POINTING if points else (None,):
                    table = Table(
                        centre=(float(x), float(shoulder[1])), height=height, half=half, quaternion=quaternion
                    )
                    if _is_reached(robot, arm, table):
                        return table
    raise ConfigError(f"arm {arm!r} of robot {robot.name!r} reaches no table in front of the robot")


def _is_reached(robot: Robot, arm: str, table: Table) -> bool:
    """Return whether the end effector reaches above the corners and the middle of a table."""
    for x, y in ((0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
        for above in (0.02, 0.15):
            try:
                posture_at(robot, arm, np.array(table.at(x, y, above)), table.quaternion)
            except ConfigError:
                return False
    return True


def _add_table(world: World, table: Table) -> Body:
    x, y = table.centre
    return world.add_box(
        (2 * (table.half + 0.05), 2 * (table.half + 0.1), THICKNESS),
        (x, y, table.height - THICKNESS / 2),
        mass=0.0,
        rgba=(0.72, 0.55, 0.38, 1.0),
        friction=0.6,
        name="table",
    )


def start_above(robot: Robot, arm: str, table: Table, *, height: float) -> None:
    """Put an arm's end effector above the middle of a table, from its present posture.

    Args:
        robot: with the arm.
        arm: its name.
        table: below the end effector.
        height: above the top (m).

    Raises:
        ConfigError: the arm does not reach the place.
    """
    robot.joint_positions = posture_at(robot, arm, np.array(table.at(0.0, 0.0, height)), table.quaternion)


def posture_at(
    robot: Robot, arm: str, position: Array, quaternion: tuple[float, float, float, float] | None
) -> Array:
    """Return the (n,) joint positions at which an arm's end effector is at a point; other joints stay.

    Args:
        robot: with the arm.
        arm: its name.
        position: (3,) in the world frame (m).
        quaternion: (4,) x, y, z, w in the world frame; None leaves the orientation free.

    Raises:
        ConfigError: the arm does not reach the point.
    """
    manipulation = robot.manipulation
    assert manipulation is not None
    moving = {robot.joint_names[k] for k in manipulation.arm_control_idx[arm]}
    q = robot.joint_positions
    locked = {
        name: float(value)
        for name, value in zip(robot.joint_names, q, strict=True)
        if name not in moving and robot.description.joint_by_name[name].mimic is None
    }
    eef = manipulation.eef_links[arm].name
    above = set()
    joint = robot.description.parent_joint.get(eef)
    while joint is not None:
        above.add(joint.name)
        joint = robot.description.parent_joint.get(joint.parent)
    chain = from_description(
        robot.description, eef, locked={name: value for name, value in locked.items() if name in above}
    )
    order = [list(robot.joint_names).index(name) for name in chain.joint_names]
    root_position, root_quaternion = robot.body.pose
    back = conjugate(root_quaternion)
    target = rotate(back, position - root_position)
    if quaternion is not None:
        target = np.concatenate([target, multiply(back, quaternion)])
    found = solve_ik(
        chain,
        target,
        q[order],
        rest=q[order],
        orientation_weights=0.0 if quaternion is None else 0.5,
        restarts=12,
    )
    if not found.converged:
        raise ConfigError(
            f"arm {arm!r} of robot {robot.name!r} does not reach {np.round(position, 3).tolist()}"
        )
    q[order] = found.q
    return q

"""Test a robot at the spawn pose as a user adds it: it starts on the floor, stands, and not on its arms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.placement import (
    lowest_collision,
    lowest_of_shapes,
    lowest_point,
    lowest_visual,
)
from roboyard.robots.stability.casters import ASSUMED_CASTERS
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.gates.weak_joints import at_limit, because_full, because_undriven
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, hold_action

MAX_DEPTH = 2e-3
"""Largest depth of a shape inside the floor at the start (m)."""
SECONDS, LEGGED_SECONDS = 5.0, 30.0
"""Duration of standing on wheels or a base, and on legs (s)."""
MAX_TILT = 0.26
"""Largest tilt of the base (rad), 15 degrees."""
MAX_DROP = 0.15
"""Largest change of the base's height, as a share of the robot's height."""
NARROW = 0.015
"""Smallest width of a support polygon, as a share of the robot's height."""
BALANCES = "which no fixed posture balances"
OFTEN = 0.3
"""Share of the time before a fall for which a drive that is named gave its greatest effort."""
UNSEEN = 0.02
"""Least depth of a link's collision shapes below its visual ones that is named (m)."""
ANGLES = 72
POSTURES = 200
"""Random postures of a robot that hangs, whose lowest point is looked for."""
CLEAR = 0.02
"""Room below the lowest of them (m)."""
PRESS = 2e-3
"""Depth to which the robot is lowered to find all points on which it stands (m)."""


def stand_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the depth in the floor at the start, the tilt while standing, and the arms that touch it."""
    robot = test_world.robot()
    start = _start(robot, is_mounted=test_world.understood.get("base") in ("fixed", "none"))
    touching = floor_contacts(robot)
    if robot.body.is_fixed and not robot.guide_joints:
        skipped = "the base is fixed"
        stand = Gate(
            name="stand",
            title="The robot stands",
            figure=0.0,
            threshold=MAX_TILT,
            unit="rad",
            skipped=skipped,
        )
        return start, stand, _arms(robot, touching)
    if not np.isfinite(lowest_collision(robot.body)):
        return start, _without_shapes(), _arms(robot, touching)
    stand, touching = _stand(robot)
    return start, stand, _arms(robot, touching)


def _without_shapes() -> Gate:
    """Return the gate of a robot that nothing carries."""
    return Gate(
        name="stand",
        title="The robot stands",
        figure=float(np.pi),
        threshold=MAX_TILT,
        unit="rad",
        findings=["no link has a collision shape: it falls through the floor"],
        advice="<collision> elements of the links that touch the floor, at least; or fixed_base=True",
    )


def _start(robot: Robot, *, is_mounted: bool) -> Gate:
    """Return the gate of the depth in the floor; visual shapes that reach below it are warnings, and so are
    robots that hang below their mount.
    """
    contacts = floor_contacts(robot)
    deepest = sorted(((-float(points[:, 3].min()), link) for link, points in contacts.items()), reverse=True)
    depth = max(deepest[0][0], 0.0) if deepest else 0.0
    visual = -lowest_visual(robot)
    found = [
        f"link {link!r} starts {d * 1e3:.1f} mm inside the floor" for d, link in deepest if d > MAX_DEPTH
    ]
    warnings = []
    if np.isfinite(visual) and visual > 5 * MAX_DEPTH:
        warnings.append(
            f"a visual shape reaches {visual * 1e3:.0f} mm below the floor that the robot stands on; its "
            "collision shapes are shorter than what is seen"
        )
    if is_mounted and robot.body.is_fixed and not robot.guide_joints:
        warnings += _hanging(robot)
    if ASSUMED_CASTERS in robot.description.link_by_name:
        warnings.append(
            "its two wheels do not carry it and the file has no caster; frictionless casters are assumed "
            "under the front and the rear of the chassis"
        )
    return Gate(
        name="start",
        title="The robot starts on the floor",
        figure=depth,
        threshold=MAX_DEPTH,
        unit="m",
        detail="deepest contact with the floor at the spawn pose, before the first step",
        findings=found,
        warnings=warnings,
        advice="on_floor and position of add_robot, and the rest posture (default_joint_pos)",
    )


def _hanging(robot: Robot) -> list[str]:
    """Return a warning about a mounted robot of which only links that move touch the floor; empty without."""
    description, body = robot.description, robot.body
    rigid = [description.root.name]
    for name in rigid:
        rigid += [joint.child for joint in description.child_joints[name] if not joint.is_moving]
    touching = sorted(_support(robot))
    if not touching or not set(touching).isdisjoint(rigid):
        return []
    start, rest = lowest_collision(body), body.joint_positions.copy()
    low, high = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    rng = np.random.default_rng(0)
    lowest = start
    for _ in range(POSTURES):
        posture = rng.uniform(low, np.maximum(low, high))
        body.joint_positions = dict(zip(robot.joint_names, posture.tolist(), strict=True))
        lowest = min(lowest, lowest_collision(body))
    body.joint_positions = rest
    height = float(body.pose[0][2]) + start - lowest + CLEAR
    return [
        f"only {', '.join(touching[:3])} touches the floor, which moves: the robot is placed with it on the "
        f"floor and its base above; mount it higher (from {height:.2f} m on, none of {POSTURES} postures "
        f"reaches the floor): add_robot(..., position=(0, 0, {height:.2f}))"
    ]


def _stand(robot: Robot) -> tuple[Gate, Mapping[str, Array]]:
    """Return the gate of standing, and the contacts with the floor after a second."""
    legged = "base" in robot.groups and robot.two_wheel is None and robot.definition.holonomic_base is None
    seconds = LEGGED_SECONDS if legged else SECONDS
    size = float(np.ptp(robot.body.bounds[:, 2])) or 1.0
    action = hold_action(robot)
    position, quaternion = robot.pose
    up = matrix_from_quaternion(quaternion)[2]
    support = _support(robot)
    cause = _cause(robot, support, size)
    unstable = _walks_on_points(robot, support, cause)
    steps = round(seconds * robot.control_freq)
    times, tilts, heights = (np.zeros(steps) for _ in range(3))
    fell, full = None, np.zeros(robot.n_dof)
    for k in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        full += at_limit(robot) if fell is None else 0.0
        now, q = robot.pose
        times[k] = (k + 1) / robot.control_freq
        tilts[k] = np.arccos(np.clip(matrix_from_quaternion(q)[2] @ up, -1.0, 1.0))
        heights[k] = now[2] - position[2]
        if fell is None and not (tilts[k] < MAX_TILT and abs(heights[k]) < MAX_DROP * size):
            fell = times[k]
    if fell is not None and not cause and full.max(initial=0.0) > OFTEN * fell * robot.control_freq:
        cause = because_full(robot, robot.joint_names[int(full.argmax())]).removeprefix("; ")
    if fell is not None and not cause:
        cause = because_undriven(robot, robot.description.joint_by_name).removeprefix("; ")
    if fell is None:
        support = floor_contacts(robot) or support
    figure = float(np.nan_to_num(tilts, nan=np.pi).max())
    drop = float(np.abs(np.nan_to_num(heights, nan=size)).max())
    if fell is not None:
        figure = max(figure, MAX_TILT * 1.01)
    findings = []
    if fell is not None and unstable:
        findings.append(
            f"it falls after {fell:.1f} s: it has two legs, and {cause}; it needs a balancing controller"
        )
    elif fell is not None:
        findings.append(
            f"it falls after {fell:.1f} s: tilted by {np.degrees(tilts.max()):.0f} degrees, height changed "
            f"by {drop:.2f} m of {size:.2f} m" + (f"; {cause}" if cause else "")
        )
    gate = Gate(
        name="stand",
        title="The robot stands",
        figure=figure,
        threshold=MAX_TILT,
        unit="rad",
        detail=f"largest tilt in {seconds:g} s of holding the rest posture; height changes by "
        f"{drop * 1e3:.0f} mm",
        findings=findings,
        advice="the rest posture (default_joint_pos), collision shapes of wheels and feet, effort limits of "
        "the legs, masses; or fixed_base=True",
        curve=Curve(
            x=times,
            lines={"tilt, rad": tilts, "height change, m": np.abs(heights)},
            x_label="time, s",
            y_label="rad, m",
        ),
    )
    return gate, support


def _support(robot: Robot) -> Mapping[str, Array]:
    """Return the contacts with the floor on which the robot stands; it is pressed into it, and put back."""
    position, quaternion = robot.body.pose
    gap = max(lowest_collision(robot.body) - lowest_point(robot), 0.0)  # below feet that are seen lower
    robot.body.set_pose(position - [0.0, 0.0, PRESS + gap], quaternion)
    found = floor_contacts(robot)
    robot.body.set_pose(position, quaternion)
    return found


def _cause(robot: Robot, contacts: Mapping[str, Array], size: float) -> str:
    """Return why a robot that stands on these contacts falls; empty where its weight is over them."""
    names = ", ".join(sorted(contacts)) or "nothing"
    centre = _centre_of_mass(robot)
    points = np.concatenate([points[:, :2] for points in contacts.values()]) if contacts else np.zeros((0, 2))
    if len(points) < 3:
        return f"it stands on {len(points)} points ({names}), {BALANCES}"
    angles = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    reach = (points @ directions.T).max(axis=0)
    width = float((reach + np.roll(reach, ANGLES // 2)).min())
    if width < NARROW * size:
        return f"its support polygon ({names}) is a line or a point, {BALANCES}"
    margin = float((reach - directions @ centre).min())
    if margin < 0.0:
        return f"its centre of mass is {-margin * 100:.1f} cm outside its support polygon ({names})"
    return ""


def _walks_on_points(robot: Robot, contacts: Mapping[str, Array], cause: str) -> bool:
    """Return whether a robot on two legs touches the floor with both, but in a line or two points only."""
    block, description = robot.locomotion, robot.description
    if block is None or BALANCES not in cause or len(contacts) != 2:
        return False
    names = set(block.joint_names)
    feet = []
    for link in contacts:
        joint = description.parent_joint.get(link)
        while joint is not None and joint.name not in names:
            joint = description.parent_joint.get(joint.parent)
        first = joint
        while joint is not None:
            first = joint if joint.name in names else first
            joint = description.parent_joint.get(joint.parent)
        feet.append(first.name if first is not None else "")
    legs = {
        name
        for name in names
        if (above := description.parent_joint.get(description.joint_by_name[name].parent)) is None
        or above.name not in names
    }
    return len(legs) == 2 and set(feet) == legs


def _centre_of_mass(robot: Robot) -> Array:
    """Return the (2,) centre of mass on the floor (m)."""
    data = robot.world.kinematics()
    return np.array(data.subtree_com[int(robot.body.mujoco_ids[0])][:2])


def _arms(robot: Robot, contacts: Mapping[str, Array]) -> Gate:
    """Return the gate of arms whose links carry the robot."""
    description = robot.description
    arms = {
        name: joint
        for arm, part in robot.arms.items()
        for name, joint in ((j, arm) for j in part.joint_names)
    }
    found = []
    for link in sorted(contacts):
        above = link
        while above in description.parent_joint:
            joint = description.parent_joint[above]
            if joint.name in arms:
                found.append(
                    f"arm {arms[joint.name]!r} carries the robot: its link {link!r} is on the floor; "
                    + (_unseen(robot, link) or "it is a leg or a wheel, or the rest posture is too low")
                )
                break
            above = joint.parent
    return Gate(
        name="arms_free",
        title="No arm carries the robot",
        figure=float(len(found)),
        threshold=0.0,
        unit="links",
        detail="links of arms in contact with the floor",
        findings=found,
        advice="manipulation.arm_joint_names (list legs in locomotion.base_joint_names), default_joint_pos",
        skipped="" if robot.arms else "the robot has no arm",
    )


def _unseen(robot: Robot, link: str) -> str:
    """Return by how much a link's collision shapes reach below its visual ones; empty where they do not."""
    own = robot.description.link_by_name[link]
    below = lowest_of_shapes(robot, link, own.visuals) - lowest_of_shapes(robot, link, own.collisions)
    if not UNSEEN < below < np.inf:
        return ""
    kinds = "/".join(sorted({type(shape.geometry).__name__.lower() for shape in own.collisions}))
    return (
        f"the collision shapes ({kinds}) that the file gives it reach {below * 1e3:.0f} mm below what is "
        "seen of it"
    )


def floor_contacts(robot: Robot) -> dict[str, Array]:
    """Return the contacts of a robot with other bodies: link to (k, 4) x, y, z and distance (m)."""
    robot.world.detect_contacts()
    found: dict[str, list[Array]] = {}
    for contact in robot.world.contacts(robot.body):
        if contact.body_a is contact.body_b:
            continue
        link = contact.link_a if contact.body_a is robot.body else contact.link_b
        found.setdefault(link.name, []).append(np.append(contact.position, contact.distance))
    return {name: np.array(points) for name, points in found.items()}

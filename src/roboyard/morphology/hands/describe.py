"""Describe a gripper or hand: kind, driven and following joints, fingertips, opening, grasp frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.description.evidence.model import FileEvidence
from roboyard.description.model import Pose, RobotDescription
from roboyard.description.semantic import Gripper, GripperKind, Opening
from roboyard.kinematics.description_poses import position_size
from roboyard.morphology.hands.frames import end_link, grasp_frame, vendor_frame
from roboyard.morphology.hands.geometry import Finger, HandGeometry
from roboyard.morphology.hands.grasp_points import grasp_points
from roboyard.morphology.hands.opening import Grasp, find_grasp, opening_of
from roboyard.morphology.joint_ranges import full_range, home_position
from roboyard.transforms import Array

HAND_FINGERS = 3
"""Fewest fingers of a hand."""
HAND_JOINTS = 2
"""Driven or following joints for each finger from which a gripper counts as a hand."""
FLAT = 0.97
"""Cosine of the largest angle between the axes of a gripper whose jaws move in one plane."""
JAWS = (2, 4)
"""Branches of a gripper with two jaws: a bar may be beside each."""
_FINGERS = ("thumb", "index", "middle", "ring", "pinky", "little")


@dataclass(frozen=True, kw_only=True, slots=True)
class FoundGripper:
    """A gripper, the end-effector link and grasp frame that go with it, and the reasons."""

    gripper: Gripper
    link: str
    """The vendor's grasp or tool frame, else the link from which the fingers move."""
    frame: Pose | None
    """Grasp frame in the link's frame; None where the link is the vendor's own frame."""
    confidence: float
    evidence: tuple[str, ...]


def describe_gripper(
    description: RobotDescription,
    palm_links: Sequence[str],
    joints: Sequence[str],
    evidence: FileEvidence | None = None,
) -> FoundGripper:
    """Describe the gripper whose fingers move from one rigid body.

    Args:
        description: the robot.
        palm_links: links of that body, the first one next to the arm.
        joints: moving joints of its fingers; none for suction.
        evidence: what the robot's files state beyond links and joints.

    Raises:
        UnknownNameError: a link or joint is not the robot's.
    """
    evidence = FileEvidence() if evidence is None else evidence
    hand = HandGeometry(description, palm_links, joints, evidence.followers)
    reasons: list[str] = []
    follow = _following(hand, evidence, reasons)
    driven = tuple(name for name in hand.joint if name not in follow and position_size(hand.joint[name]) == 1)
    grasp = find_grasp(hand)
    kind = _kind(hand, grasp, driven)
    ways = _ways(hand, grasp, driven, kind, reasons)
    link = vendor_frame(palm_links)
    reasons.append(
        f"{link!r} is the vendor's grasp frame" if link else f"the fingers move from {hand.palm!r}"
    )
    frame = grasp_frame(hand, grasp, hand.palm) if link is None and grasp is not None else None
    start, end = grasp_points(hand, grasp) if grasp is not None else ((), ())
    tips = tuple(tip for tip in map(hand.tip_link, hand.fingers) if tip is not None)
    gripper = Gripper(
        kind=kind,
        palm=hand.palm,
        joints=driven,
        mimic_joints=tuple(name for name in hand.joint if name in follow),
        links=tuple(dict.fromkeys(name for finger in hand.fingers for name in finger.links)),
        fingertips=tuple(dict.fromkeys(tips)),
        opening=_common(_moving(hand, driven, spread=kind != "hand"), ways),
        opening_of=ways,
        width=_width(hand, grasp, ways, kind),
        start_points=start,
        end_points=end,
    )
    return FoundGripper(
        gripper=gripper,
        link=link or (hand.palm if joints else end_link(description, palm_links)),
        frame=frame,
        confidence=_confidence(gripper, evidence),
        evidence=tuple(reasons),
    )


def _following(hand: HandGeometry, evidence: FileEvidence, reasons: list[str]) -> set[str]:
    """Return the joints that follow others or have no motor."""
    follow = set(hand.leaders)
    if follow:
        reasons.append(f"{len(follow)} of {len(hand.joint)} joints follow others, as the file states")
    passive = set() if evidence.srdf is None else set(evidence.srdf.passive_joints)
    idle = {name for name in hand.joint if name in passive}
    moved = [name for name in hand.joint if name in evidence.actuated]
    if moved and len(moved) < len(hand.joint) - len(follow):
        idle |= {name for name in hand.joint if name not in evidence.actuated}
        reasons.append(f"only {', '.join(moved[:4])} have a motor, as transmissions or controllers state")
    elif idle:
        reasons.append(f"{len(idle)} joints are passive, as the SRDF states")
    return follow | idle if set(hand.joint) - follow - idle else follow


def _kind(hand: HandGeometry, grasp: Grasp | None, driven: Sequence[str]) -> GripperKind:
    if not hand.joint:
        return "suction"
    fingers = [finger for finger in hand.fingers if hand.tip_link(finger) is not None] or list(hand.fingers)
    if len(fingers) == 1:
        return "single_jaw"
    names = [name.lower() for finger in fingers for name in finger.joints]
    named = sum(any(word in name for name in names) for word in _FINGERS) >= 2
    many = len(hand.joint) >= HAND_JOINTS * len(fingers)
    own = len(driven) > len(fingers) or not _is_flat(hand, fingers)
    if len(fingers) >= HAND_FINGERS and (named or (many and own)):
        return "hand"
    if len(fingers) == 2 or _is_flat(hand, fingers):
        return "two_jaw"
    return "fingers"


def _is_flat(hand: HandGeometry, fingers: Sequence[Finger]) -> bool:
    """Return whether all joints turn about parallel axes and no two fingers stand beside each other."""
    poses = hand.poses({})
    axes, spots = [], []
    for finger in fingers:
        for name in finger.joints:
            joint = hand.joint[name]
            if joint.type == "prismatic":
                return len(fingers) == 2
            axes.append(poses[joint.child][:3, :3] @ np.asarray(joint.axis))
            spots.append(poses[joint.child][:3, 3])
    along = np.abs(np.array(axes) @ axes[0])
    reach = max(float(np.ptp(np.array(spots), axis=0).max()), 1e-6)
    return bool(along.min() >= FLAT) and float(np.ptp(np.array(spots) @ axes[0])) < 0.25 * reach


def _ways(
    hand: HandGeometry, grasp: Grasp | None, driven: Sequence[str], kind: GripperKind, reasons: list[str]
) -> dict[str, Opening]:
    """Return the direction that opens, by driven joint."""
    if grasp is None:
        return _ways_of_frames(hand, driven, reasons)
    ways: dict[str, Opening] = {}
    for name in driven:
        way, change = opening_of(hand, grasp, name)
        if way is not None:
            ways[name] = way
            if kind in ("single_jaw", "two_jaw"):
                against = "the fixed jaw" if kind == "single_jaw" else "the other tip"
                moves = f"the tip moves {1e3 * change:.0f} mm away from {against}"
                reasons.append(f"{moves} with {way} {name!r}")
    return ways or _ways_of_frames(hand, driven, reasons)


def _ways_of_frames(hand: HandGeometry, driven: Sequence[str], reasons: list[str]) -> dict[str, Opening]:
    """Return the direction that opens jaws without shapes: that in which their outermost frames part."""
    home = hand.poses({})
    leaders = {follower.leader for follower in hand.leaders.values()}
    ways: dict[str, Opening] = {}
    for name in driven:
        limits = hand.joint[name].position_limits()
        fingers = hand.fingers if len(hand.fingers) in JAWS else _led(hand, name)
        if limits is None or not (name in leaders or len(driven) > 1) or len(fingers) not in JAWS:
            continue
        tips = [_outermost(hand, finger, home) for finger in fingers]
        poses = hand.poses({name: np.array(limits)})
        spots = np.array([np.broadcast_to(poses[tip][..., :3, 3], (2, 3)) for tip in tips])
        gaps = np.linalg.norm(spots[:, None] - spots[None], axis=-1).sum(axis=(0, 1))
        if abs(gaps[1] - gaps[0]) > 2e-3:
            ways[name] = "increasing" if gaps[1] > gaps[0] else "decreasing"
            reasons.append(f"no shape shows it; the fingers' frames part with {ways[name]} {name!r}")
    return ways


def _outermost(hand: HandGeometry, finger: Finger, poses: Mapping[str, Array]) -> str:
    """Return the link of a finger whose frame is farthest from its first joint."""
    start = poses[finger.links[0]][:3, 3]
    return max(finger.links, key=lambda link: float(np.linalg.norm(poses[link][:3, 3] - start)))


def _led(hand: HandGeometry, name: str) -> tuple[Finger, ...]:
    """Return the fingers in which joints follow a joint."""
    follow = {other for other, leader in hand.leaders.items() if leader.leader == name}
    return tuple(finger for finger in hand.fingers if follow & set(finger.joints))


def _moving(hand: HandGeometry, driven: Sequence[str], *, spread: bool) -> list[str]:
    """Return the driven joints that move a shape, themselves or by their followers; the others (a motor, a
    screw, a measuring frame) are for show. With `spread`, only those that move two fingers or more where
    there are some: the others are springs.
    """
    both = [name for name in driven if len(_led(hand, name)) > 1]
    if spread and both:
        return both
    found = []
    for name in driven:
        moved = {name, *(other for other, leader in hand.leaders.items() if leader.leader == name)}
        links = {link for each in moved for link in _links_below(hand, each)}
        if any(len(hand.link_points(link)) for link in links):
            found.append(name)
    return found or list(driven)


def _links_below(hand: HandGeometry, name: str) -> list[str]:
    links = [hand.joint[name].child]
    for link in links:
        links += [joint.child for joint in hand.description.child_joints[link]]
    return links


def _common(driven: Sequence[str], ways: dict[str, Opening]) -> Opening | None:
    """Return the direction of all driven joints; None where they differ or one shows none."""
    way = ways.get(driven[0]) if driven else None
    return way if all(ways.get(name) == way for name in driven) else None


def _width(
    hand: HandGeometry, grasp: Grasp | None, ways: dict[str, Opening], kind: GripperKind
) -> float | None:
    """Return the gap between the tips of two jaws, all joints open (m)."""
    if grasp is None or kind != "two_jaw" or not all(grasp.sides):
        return None
    wide = {}
    for name, way in ways.items():
        joint = hand.joint[name]
        lower, upper = full_range(joint, home_position(joint))
        wide[name] = upper if way == "increasing" else lower
    poses = hand.poses(wide)
    near: list[float] = []
    for side, sign in zip(grasp.sides, (1.0, -1.0), strict=True):
        tips = [hand.tip_points(finger, grasp.approach, poses) for finger in side]
        along = [points @ grasp.across for points in tips if points is not None]
        if along:
            near.append(float((sign * np.concatenate(along)).max()))
    return max(0.0, -sum(near)) if len(near) == 2 else None


def _confidence(gripper: Gripper, evidence: FileEvidence) -> float:
    """Return how sure driven joints and opening are."""
    if gripper.kind == "suction":
        return 0.7 if any(plugin.kind == "suction" for plugin in evidence.plugins) else 0.5
    share = len(gripper.opening_of) / max(1, len(gripper.joints))
    return round(0.6 + 0.3 * share + 0.05 * bool(gripper.fingertips), 2)

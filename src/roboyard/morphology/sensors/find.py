"""Find the cameras, lidars and IMUs of a robot: one of each physical sensor.

Names say which links are frames of a sensor, simulator blocks which links carry one. Frames of one sensor are
joined by fixed joints: a frame below another one, or frames side by side with one name but for words such as
depth or colour. What carries a sensor, a marker or a computed scan is none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from roboyard.description.evidence.model import FileEvidence, StatedSensor
from roboyard.description.model import Pose, RobotDescription
from roboyard.description.semantic import MountedKind, MountedSensor
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.sensors.names import (
    is_mount,
    is_optical,
    is_range_finder,
    mount_words,
    named_kinds,
    place,
    stem,
    words,
)
from roboyard.transforms import Array

KINDS: tuple[MountedKind, ...] = ("camera", "lidar", "imu")
FARTHEST_BELOW = 0.35
"""Largest distance of a sensor's frame from the frame of it above (m)."""
FARTHEST_BESIDE = 0.2
"""Largest distance between frames of one sensor that stand side by side (m)."""
SIDES = frozenset(("left", "right", "front", "rear", "back", "top", "bottom", "upper", "lower"))
"""Words of places: frames that differ in one of them and are apart belong to two sensors."""
SCAN_SAMPLES = 90
"""Rays in one sweep from which a sensor scans, though its name says that it measures one distance."""
UNNAMED = ("link", "frame", "optical", "sensor", "camera", "cam")
"""Words of a link that a sensor's name does without."""
CAMERA_ORDER = ("color", "colour", "rgb", "left", "")
"""Words of the optical frame that is taken, best first."""


@dataclass(frozen=True, kw_only=True, slots=True)
class FoundSensor:
    """A sensor with the reasons for it."""

    sensor: MountedSensor
    members: tuple[str, ...]
    """All links that are frames of it, depth first."""
    confidence: float
    evidence: tuple[str, ...]


@dataclass(kw_only=True, slots=True)
class _Device:
    kind: MountedKind
    members: list[str]
    stated: list[StatedSensor] = field(default_factory=list)


def find_sensors(
    description: RobotDescription, evidence: FileEvidence | None = None
) -> tuple[FoundSensor, ...]:
    """Return the sensors, cameras first, each kind depth first.

    Args:
        description: the robot.
        evidence: what its files state beyond links and joints.
    """
    stated = () if evidence is None else evidence.sensors
    order = _depth_first(description)
    frames = forward_kinematics(description)
    kind_of = _kinds(description, order, stated)
    devices = [device for kind in KINDS for device in _devices(description, order, kind_of, frames, kind)]
    _add_stated(description, devices, stated, kind_of)
    devices = [device for device in devices if not _is_carrier_only(description, device, devices)]
    _drop_inner_imus(description, devices)
    names: set[str] = set()
    found = []
    for kind in KINDS:
        same = [device for device in devices if device.kind == kind]
        for device in sorted(same, key=lambda device: order[device.members[0]]):
            found.append(_found(description, device, frames, names))
    return tuple(found)


def _depth_first(description: RobotDescription) -> dict[str, int]:
    names = [description.root.name, *(joint.child for joint in description.depth_first_joints)]
    return {name: index for index, name in enumerate(names)}


def _kinds(
    description: RobotDescription, order: Mapping[str, int], stated: Sequence[StatedSensor]
) -> dict[str, MountedKind]:
    """Return links whose name says that they are a sensor's frame, with its kind."""
    by_block = {s.link: s.kind for s in stated if s.kind != "other" and not _is_range(s)}
    found: dict[str, MountedKind] = {}
    for link in order:
        kinds = named_kinds(link)
        block = by_block.get(link)
        if block in KINDS and kinds:
            found[link] = block
        elif len(kinds) == 1:
            found[link] = next(iter(kinds))
        elif "imu" in kinds:  # the IMU inside a camera or a lidar
            found[link] = "imu"
    return {link: kind for link, kind in found.items() if not _carries_joints(description, link)}


def _carries_joints(description: RobotDescription, link: str) -> bool:
    """Return whether a moving joint hangs from a link, through fixed joints too."""
    open_links = [link]
    while open_links:
        for joint in description.child_joints.get(open_links.pop(), ()):
            if joint.is_moving:
                return True
            open_links.append(joint.child)
    return False


def _devices(
    description: RobotDescription,
    order: Mapping[str, int],
    kind_of: Mapping[str, MountedKind],
    frames: Mapping[str, Array],
    kind: MountedKind,
) -> list[_Device]:
    """Group the frames of one kind into sensors."""
    devices: list[_Device] = []
    of: dict[str, _Device] = {}
    for link in order:
        if kind_of.get(link) != kind:
            continue
        above = description.parent_joint.get(link)
        device = None
        if above is not None and not above.is_moving:
            device = of.get(above.parent)
            if device is not None and not _is_below(above.parent, link, frames):
                device = None
            if device is None:
                beside = (j.child for j in description.child_joints[above.parent] if not j.is_moving)
                same = (other for other in beside if other in of and _is_beside(other, link, frames, kind))
                device = next((of[other] for other in same), None)
        if device is None:
            device = _Device(kind=kind, members=[])
            devices.append(device)
        device.members.append(link)
        of[link] = device
    return devices


def _distance(first: str, second: str, frames: Mapping[str, Array]) -> float:
    return float(np.linalg.norm(frames[first][:3, 3] - frames[second][:3, 3]))


def _is_below(above: str, link: str, frames: Mapping[str, Array]) -> bool:
    a, b = place(above), place(link)
    if not (a <= b or b <= a):
        return False
    return _distance(above, link, frames) <= (FARTHEST_BESIDE if (a ^ b) & SIDES else FARTHEST_BELOW)


def _is_beside(first: str, second: str, frames: Mapping[str, Array], kind: MountedKind) -> bool:
    """Return whether two frames on one link are of one sensor."""
    if _distance(first, second, frames) > FARTHEST_BESIDE:
        return False
    a, b = set(stem(first)), set(stem(second))
    if a == b:
        return ("bottom" in _place_words(first)) == ("bottom" in _place_words(second))
    apart = a ^ b
    if kind == "camera" and apart <= {"left", "right", "l", "r"} and a & b:
        return "imager" in (*words(first), *words(second)) or is_optical(first) or is_optical(second)
    return kind == "imu" and {word for word in apart if not word.startswith(("imu", "gyro", "acc"))} == set()


def _place_words(name: str) -> tuple[str, ...]:
    """Return the words of a name; none where it is a screw's, whose place is within the sensor."""
    return () if "screw" in words(name) else words(name)


def _is_range(sensor: StatedSensor) -> bool:
    if sensor.samples >= SCAN_SAMPLES:
        return False
    return is_range_finder(sensor.name) or is_range_finder(sensor.link)


def _add_stated(
    description: RobotDescription,
    devices: list[_Device],
    stated: Sequence[StatedSensor],
    kind_of: Mapping[str, MountedKind],
) -> None:
    """Assign the stated sensors to the devices; those without a device become one."""
    for sensor in stated:
        if sensor.kind == "other" or _is_range(sensor):
            continue
        links = (sensor.link, sensor.frame_link)
        same = [device for device in devices if device.kind == sensor.kind]
        device = next((d for d in same if any(link in d.members for link in links)), None)
        below = {j.child for j in description.child_joints[sensor.link] if not j.is_moving}
        near = [d for d in same if d.members[0] in below and (device is None or d is device)]
        if len(near) == 1 and not named_kinds(sensor.link) - {sensor.kind}:
            device = near[0]
            device.members.insert(0, sensor.link)
        if device is None and kind_of.get(sensor.link) not in (None, sensor.kind):
            continue  # a scan computed from a camera, the IMU in a camera
        if device is None:
            device = _Device(kind=sensor.kind, members=[sensor.link])
            devices.append(device)
        device.stated.append(sensor)


def _is_carrier_only(description: RobotDescription, device: _Device, devices: Sequence[_Device]) -> bool:
    """Return whether nothing but the carrier of a sensor, or of several sensors, is there."""
    if device.stated:
        return False
    above = [description.parent_joint.get(d.members[0]) for d in devices if d.kind == device.kind]
    carried = sum(joint is not None and joint.parent in device.members for joint in above)
    if carried > 1 and len(device.members) == 1:
        return True
    return all(is_mount(link) for link in device.members) and not any(
        is_optical(link) for link in device.members
    )


def _drop_inner_imus(description: RobotDescription, devices: list[_Device]) -> None:
    """Remove the IMUs that are parts of a camera or a lidar."""
    others = {link for device in devices if device.kind != "imu" for link in device.members}

    def is_inner(device: _Device) -> bool:
        first = device.members[0]
        above = description.parent_joint.get(first)
        inside = above is not None and not above.is_moving and above.parent in others
        return inside or len(named_kinds(first)) > 1

    devices[:] = [device for device in devices if device.kind != "imu" or not is_inner(device)]


def _found(
    description: RobotDescription, device: _Device, frames: Mapping[str, Array], names: set[str]
) -> FoundSensor:
    link = _main_link(device)
    optical = _optical_link(device, frames) if device.kind == "camera" else None
    reasons = []
    if named_kinds(link):
        reasons.append(f"the name {link!r} is a {device.kind}'s")
    reasons += [f"the file states sensor {s.name!r} on {s.link!r}" for s in device.stated[:2]]
    if optical is not None:
        reasons.append(f"{optical!r} is its optical frame")
    if len(device.members) > 1:
        reasons.append(f"{len(device.members)} frames on fixed joints belong to it")
    has_shape = any(
        description.link_by_name[m].visuals or description.link_by_name[m].collisions for m in device.members
    )
    if has_shape:
        reasons.append("it has a shape")
    strong = bool(device.stated) + (optical is not None) + has_shape + (len(device.members) > 1)
    frame = next((s.pose for s in device.stated if s.link == link and s.pose != Pose()), None)
    sensor = MountedSensor(
        kind=device.kind,
        name=_free_name(link, device.kind, names),
        link=link,
        optical_link=optical,
        frame=frame,
    )
    confidence = min(0.98, 0.75 + 0.08 * strong) if named_kinds(link) else 0.9 if device.stated else 0.5
    if "radar" in words(link):
        confidence = min(confidence, 0.7)
    return FoundSensor(
        sensor=sensor, members=tuple(device.members), confidence=confidence, evidence=tuple(reasons)
    )


def _main_link(device: _Device) -> str:
    """Return the link that is the sensor's body: the first that is no carrier and no optical frame."""
    bodies = [link for link in device.members if not is_optical(link)] or device.members
    return min(bodies, key=lambda link: (device.kind not in named_kinds(link), mount_words(link)))


def _optical_link(device: _Device, frames: Mapping[str, Array]) -> str | None:
    named = [link for link in device.members if is_optical(link)]
    named += [s.frame_link for s in device.stated if s.frame_link is not None and is_optical(s.frame_link)]
    for word in CAMERA_ORDER:
        for link in named:
            if not word or word in words(link):
                return link
    return None


def _free_name(link: str, kind: str, names: set[str]) -> str:
    """Return a short name for a sensor that no other has."""
    parts = [
        word for word in words(link) if word not in ("link", "frame", "optical", "sensor", "camera", "cam")
    ]
    short = "_".join(parts) or kind
    wanted = short if kind in short or kind != "camera" else f"{short}_camera"
    wanted = kind if wanted == f"{kind}_camera" or not parts else wanted
    name, number = wanted, 2
    while name in names:
        name, number = f"{wanted}_{number}", number + 1
    names.add(name)
    return name

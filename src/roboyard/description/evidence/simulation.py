"""Sensors, plugins and actuated joints in `<gazebo>`, `<sensor>`, `<transmission>`, `<ros2_control>`."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from itertools import islice

from roboyard.description.evidence.model import Follower, Plugin, PluginKind, SensorKind, StatedSensor
from roboyard.description.model import Pose, RobotDescription
from roboyard.transforms import quaternion_from_rpy

MOST = 2000
"""Most elements of one kind that are read."""
_SENSORS: tuple[tuple[str, SensorKind], ...] = (
    ("imu", "imu"),
    ("lidar", "lidar"),
    ("laser", "lidar"),
    ("ray", "lidar"),
    ("camera", "camera"),
    ("depth", "camera"),
    ("rgbd", "camera"),
    ("multicamera", "camera"),
)
"""Words of a sensor's type and its kind; the first that the type contains counts."""
_PLUGINS: tuple[tuple[str, PluginKind], ...] = (
    ("skid_steer", "skid"),
    ("skidsteer", "skid"),
    ("diff_drive", "differential"),
    ("diffdrive", "differential"),
    ("planar_move", "holonomic"),
    ("mecanum", "holonomic"),
    ("omni", "holonomic"),
    ("ackermann", "ackermann"),
    ("vacuum", "suction"),
    ("suction", "suction"),
    ("mimic", "mimic"),
    ("underactuated", "mimic"),
)


def read_sensors(description: RobotDescription) -> tuple[StatedSensor, ...]:
    """Return the sensors that the file states on links that exist, in file order."""
    found = []
    for element in _extra(description, "gazebo"):
        carrier = (element.get("reference") or "").strip()
        for sensor in _sensor_elements(element):
            found.append(_sensor(description, sensor, carrier))
    for element in _extra(description, "sensor"):
        parent = element.find("parent")
        found.append(_sensor(description, element, "" if parent is None else parent.get("link") or ""))
    for link in description.links:
        for extra in link.extra:
            found += [_sensor(description, sensor, link.name) for sensor in _sensor_elements(extra)]
    return tuple(sensor for sensor in islice(found, MOST) if sensor.link in description.link_by_name)


def read_plugins(description: RobotDescription) -> tuple[Plugin, ...]:
    """Return the plugins of all `<gazebo>` blocks, those of sensors excluded, in file order."""
    found = []
    for element in _extra(description, "gazebo"):
        for plugin in islice(_top_plugins(element), MOST):
            words: dict[str, list[str]] = {}
            for part in islice(plugin.iter(), MOST):
                text = (part.text or "").strip()
                if part is not plugin and isinstance(part.tag, str) and text and len(text) < 500:
                    words.setdefault(part.tag, []).append(text)
            name = plugin.get("filename") or plugin.get("plugin") or ""
            plain = f"{name} {plugin.get('name') or ''}".lower()
            kind = _plugin_kind(plain)
            held = {tag: tuple(texts) for tag, texts in words.items()}
            found.append(Plugin(kind=kind, filename=name, words=held))
    return tuple(found)


def read_actuated(description: RobotDescription) -> tuple[str, ...]:
    """Return the joints with a transmission or a command interface, in file order.

    A `<ros2_control>` joint that states a leader is not among them.
    """
    names: dict[str, None] = {}
    for element in _extra(description, "transmission"):
        for joint in element.findall("joint"):
            names[(joint.get("name") or "").strip()] = None
    followers = {follower.joint for follower in read_followers(description)}
    for element in _extra(description, "ros2_control"):
        for joint in element.iter("joint"):
            name = (joint.get("name") or "").strip()
            if joint.find("command_interface") is not None and name not in followers:
                names[name] = None
    return tuple(name for name in names if name in description.joint_by_name)


def read_followers(description: RobotDescription) -> tuple[Follower, ...]:
    """Return followers that mimic plugins and `<ros2_control>` parameters state, in file order."""
    found = []
    for plugin in read_plugins(description):
        if plugin.kind != "mimic":
            continue
        joints, leaders = (_first(plugin, tags) for tags in (("mimicJoint", "mimic_joint"), ("joint",)))
        if joints and leaders:
            found.append(
                Follower(
                    joint=joints,
                    leader=leaders,
                    multiplier=_number(_first(plugin, ("multiplier",)), 1.0),
                    offset=_number(_first(plugin, ("offset",)), 0.0),
                )
            )
        leader = _first(plugin, ("actuatedJoint",))
        scales = [_number(text, 1.0) for text in plugin.words.get("scale_factor", ())]
        for index, name in enumerate(plugin.words.get("name", ()) if leader else ()):
            scale = scales[index] if index < len(scales) and scales[index] else 1.0
            found.append(Follower(joint=name, leader=leader, multiplier=1.0 / scale))
    for element in _extra(description, "ros2_control"):
        for joint in element.iter("joint"):
            params = {(p.get("name") or ""): (p.text or "").strip() for p in joint.findall("param")}
            if params.get("mimic"):
                found.append(
                    Follower(
                        joint=(joint.get("name") or "").strip(),
                        leader=params["mimic"],
                        multiplier=_number(params.get("multiplier"), 1.0),
                        offset=_number(params.get("offset"), 0.0),
                    )
                )
    known = description.joint_by_name
    return tuple(f for f in found if f.joint in known and f.leader in known and f.joint != f.leader)


def _extra(description: RobotDescription, tag: str) -> Iterable[ET.Element]:
    return islice((element for element in description.extra if element.tag == tag), MOST)


def _sensor_elements(element: ET.Element) -> Iterator[ET.Element]:
    """Yield `<sensor>` elements, also the old `<sensor:camera>`."""
    for part in element.iter():
        if isinstance(part.tag, str) and (part.tag == "sensor" or part.tag.startswith("sensor:")):
            yield part


def _top_plugins(element: ET.Element) -> Iterator[ET.Element]:
    for part in element:
        if isinstance(part.tag, str) and (part.tag == "plugin" or part.tag.startswith("controller:")):
            yield part


def _sensor(description: RobotDescription, element: ET.Element, carrier: str) -> StatedSensor:
    kind_text = element.get("type") or (element.tag.partition(":")[2] if ":" in element.tag else "")
    words = kind_text.lower() or " ".join(str(child.tag).lower() for child in element)
    kind = _sensor_kind(words)
    named = ("frameName", "frame_name", "optical_frame", "gz_frame_id", "ignition_frame_id", "frame_id")
    frames = [
        (part.text or "").strip().lstrip("/")
        for part in element.iter()
        if isinstance(part.tag, str) and part.tag in named
    ]
    return StatedSensor(
        kind=kind,
        name=(element.get("name") or "").strip(),
        link=carrier.strip(),
        frame_link=next((name for name in frames if name in description.link_by_name), None),
        pose=_pose(element),
        samples=_samples(element),
    )


def _samples(element: ET.Element) -> int:
    """Return the rays in one horizontal sweep; 0 where none are stated."""
    sweep = next(element.iter("horizontal"), None)
    return int(max(0.0, min(_number(sweep.findtext("samples"), 0.0), 1e6))) if sweep is not None else 0


def _pose(element: ET.Element) -> Pose:
    """Return the pose of a sensor: SDF's `<pose>`, or `<origin>`; the identity where it cannot be read."""
    text = element.findtext("pose") or ""
    origin = element.find("origin")
    if origin is not None and origin.get("xyz"):
        text = f"{origin.get('xyz')} {origin.get('rpy') or '0 0 0'}"
    numbers = [_number(part, math.nan) for part in text.split()]
    if len(numbers) != 6 or not all(math.isfinite(number) for number in numbers):
        return Pose()
    x, y, z, w = (float(part) for part in quaternion_from_rpy(numbers[3:]))
    return Pose(position=(numbers[0], numbers[1], numbers[2]), quaternion=(x, y, z, w))


def _sensor_kind(text: str) -> SensorKind:
    for word, kind in _SENSORS:
        if word in text:
            return kind
    return "other"


def _plugin_kind(text: str) -> PluginKind:
    for word, kind in _PLUGINS:
        if word in text:
            return kind
    return "other"


def _first(plugin: Plugin, tags: tuple[str, ...]) -> str:
    return next((plugin.words[tag][0] for tag in tags if tag in plugin.words), "")


def _number(text: str | None, otherwise: float) -> float:
    try:
        value = float(text or "")
    except ValueError:
        return otherwise
    return value if math.isfinite(value) else otherwise

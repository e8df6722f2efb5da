"""Names of sensors: products, words and the parts of a sensor's frame tree, in several vendors' habits."""

from __future__ import annotations

import re
from functools import lru_cache
from itertools import pairwise

from roboyard.description.semantic import MountedKind

_STRONG: dict[MountedKind, re.Pattern[str]] = {
    "camera": re.compile(
        r"(?:web|usb|eye|hand|wrist|head|nav|pi)?cam(?:era)?s?\d*(?:left|right|front|rear|back|head|link|frame)?"
        r"|realsense\d*|rs\d{3}|[dlr][24]\d\d[a-z]?|d5\d\d[a-z]?|t265|sr300|zed[\dmxi]*|kinect\w*|k4a|xtion\w*"
        r"|rgb|astra\w*|orbbec|femto|gemini\d+\w*|oak\w?|rgbd|stereo\w*|primesense|carmine|imager|multisense|bumblebee\d?"
        r"|mynteye|basler|flir|gopro|fisheye|raspicam|picam|ensenso|photoneo|zivid|optical|\w*camera\w*|camara|kamera"
    ),
    "lidar": re.compile(
        r"lidar\w*|laser\d*(?:scan|scanner|link|frame)?|velodyne\w*|vlp\d+\w*|hdl\d+\w*|livox|mid360\w*|mid\d\d|hokuyo\w*"
        r"|urg\w*|u[st][tms]\d\d\w*|rplidar\w*|[ylpu]\w?lidar\w*|ld\d\d|sick\w*|tim\d{3}\w*|lms\d\w*|s300\w*|s3000"
        r"|nanoscan\w*|microscan\w*|picoscan\w*|ouster|os[012]|hesai|pandar\w*|xt16|rslidar\w*|robosense|helios|radar"
        r"|scan|scanner|\w+lidar|unilidar"
    ),
    "imu": re.compile(
        r"imu\w*|\w+imu|gyro|gyros|gyroscope|gyrometer|ahrs|vectornav|vn100|xsens|mti\d*|microstrain"
    ),
}
"""Kind to the words any of which names a sensor of that kind."""
_JOINED = ("realsense", "rplidar", "webcam", "laserscanner", "laserscan")
"""Words that vendors also write as two."""
_PART = re.compile(
    r"depth|colou?r|rgb|infra\d*|ir\d*|nir|mono|lens|module|optical|frame|link|sensor|body|axis|parent|accel\w*"
    r"|accelerometer|gyro\w*|housing|center|centre|screw|bottom|plate|imager|joint|data|raw|origin|base|mount|fixed|device"
)
"""Words that differ between the frames of one sensor."""
_MOUNT = re.compile(
    r"mount\w*|bracket\w*|support\w*|holder|cage|stand|pole|mast|tower|arm|pan|tilt|yaw|pitch|roll|motor|cover|plate|tripod|case"
    r"|bridge|adapter|adaptor|riser|guard|roll_?cage|screw|cable|shell|frame_?holder|neck|wall|hinge|stand_?off\w*|spacer\w*|post|pillar|strut"
)
"""Words of what carries a sensor."""
_PLACES = frozenset(("f", "r", "l", "b", "front", "rear", "left", "right", "back"))
"""Words of places before which `dc` and `oc` are short for depth camera and optical camera."""
_CARRIED = frozenset(("arm", "neck"))
"""Words of `_MOUNT` that say where a sensor is when they stand before its word."""
_GENERIC = frozenset(
    ("camera", "cam", "stereo", "rgbd", "lidar", "laser", "scan", "scanner", "imu", "mounted")
)
"""Words of a kind of sensor, of any place and make."""
_NO_SENSOR = re.compile(
    r"aruco|marker|apriltag|tag|target|calib\w*|virtual|dummy|fake|rfid|barcode|pointer|projector|led|light|flash"
)
"""Words with which a link is no sensor."""
_RANGE = re.compile(
    r"sonar\w*|ultraso\w*|us\d*|cliff\w*|bumper\w*|ir\d*|range\w*|tof\d*|proximity|microphone\w*"
)
"""Words of sensors that measure one distance; simulators state them as rays."""


@lru_cache(maxsize=8192)
def words(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case with their digits: `D435_headCamera` is d435, head, camera."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    return tuple(re.findall(r"[^\W_]+", spaced.lower()))


@lru_cache(maxsize=8192)
def named_kinds(name: str) -> frozenset[MountedKind]:
    """Return the kinds of sensors that a name's words mean; empty where another word rules a sensor out."""
    parts = words(name)
    if any(_NO_SENSOR.fullmatch(word) for word in parts):
        return frozenset()
    if len(parts) > 1 and parts[0] in _PLACES and parts[1] in ("dc", "oc"):
        return frozenset(("camera",))
    pairs = ["".join(pair) for pair in pairwise(parts)]
    joined = (*parts, *(pair for pair in pairs if pair[-1].isdigit() or pair in _JOINED))
    return frozenset(
        kind for kind, pattern in _STRONG.items() if any(pattern.fullmatch(word) for word in joined)
    )


def is_optical(name: str) -> bool:
    """Return whether a name is that of an optical frame."""
    return "optical" in words(name)


def is_mount(name: str) -> bool:
    """Return whether a name is of what carries a sensor: a camera's arm is, the camera of an arm is not."""
    parts = words(name)
    sensors = [k for k, word in enumerate(parts) if any(one.fullmatch(word) for one in _STRONG.values())]
    places = _CARRIED if sensors else frozenset[str]()
    first = max(sensors, default=-1)
    carriers = (w for k, w in enumerate(parts) if _MOUNT.fullmatch(w) and not (k < first and w in places))
    return not is_optical(name) and any(carriers)


def is_range_finder(name: str) -> bool:
    """Return whether a name is of a sensor that measures one distance."""
    return any(_RANGE.fullmatch(word) for word in words(name))


def mount_words(name: str) -> int:
    """Return how many words of a name are of what carries a sensor."""
    return sum(_MOUNT.fullmatch(word) is not None for word in words(name))


def place(name: str) -> frozenset[str]:
    """Return a name's words that say where a sensor is or which one it is."""
    return frozenset(word for word in stem(name) if not _MOUNT.fullmatch(word) and word not in _GENERIC)


def stem(name: str) -> tuple[str, ...]:
    """Return a name's words without those that differ between the frames of one sensor."""
    return tuple(word for word in words(name) if not _PART.fullmatch(word))

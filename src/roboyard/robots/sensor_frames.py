"""Frames of cameras and lidars of an imported robot, from its MJCF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roboyard.description.urdf.xml import read_xml
from roboyard.transforms import IDENTITY_QUATERNION, Array, from_wxyz, normalized


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SensorFrame:
    """The frame of a sensor on a link."""

    name: str
    link: str
    position: Array
    """(3,) position in the link's frame (m)."""
    quaternion: Array
    """(4,) quaternion x, y, z, w in the link's frame."""


class CameraFrame(SensorFrame):
    """The frame of a camera: -z forward, +y up."""

    __slots__ = ()


class LidarFrame(SensorFrame):
    """The frame of a lidar: +z up, azimuth 0 along +x."""

    __slots__ = ()


def camera_frames(mjcf: Path) -> tuple[CameraFrame, ...]:
    """Return the cameras of an MJCF file, in file order.

    Raises:
        DescriptionError: the file is not XML.
    """
    root, _ = read_xml(mjcf)
    return tuple(
        CameraFrame(name=camera.get("name") or "camera", link=body.get("name") or "", **_placed(camera))
        for body in root.iter("body")
        for camera in body.findall("camera")
    )


def lidar_frames(mjcf: Path) -> tuple[LidarFrame, ...]:
    """Return the lidars of an MJCF file, in file order: the sites named "<link>_lidar...".

    Raises:
        DescriptionError: the file is not XML.
    """
    root, _ = read_xml(mjcf)
    return tuple(
        LidarFrame(name=site.get("name") or "", link=body.get("name") or "", **_placed(site))
        for body in root.iter("body")
        for site in body.findall("site")
        if (site.get("name") or "").startswith(f"{body.get('name')}_lidar")
    )


def _placed(element: ET.Element) -> dict[str, Array]:
    position = np.array((element.get("pos") or "0 0 0").split(), dtype=float)
    given = element.get("quat")
    if given is None:
        return {"position": position, "quaternion": np.array(IDENTITY_QUATERNION)}
    return {
        "position": position,
        "quaternion": from_wxyz(normalized(np.array(given.split(), dtype=float))),
    }

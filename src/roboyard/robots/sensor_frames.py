"""Cameras of an imported robot: read from its MJCF, where the importer puts each on its link."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from roboyard.poses import IDENTITY_QUATERNION, Array, from_wxyz, normalized
from roboyard.urdf.xml import read_xml


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class CameraFrame:
    """One camera; it looks along -z, +y up."""

    name: str
    link: str
    position: Array
    """(3,) in the link's frame; m"""
    quaternion: Array
    """(4,) x, y, z, w in the link's frame"""


def camera_frames(mjcf: Path) -> tuple[CameraFrame, ...]:
    """All cameras of an MJCF file, in file order.

    Raises:
        DescriptionError: the file is no XML.
    """
    import numpy as np

    root, _ = read_xml(mjcf)
    found = []
    for body in root.iter("body"):
        for camera in body.findall("camera"):
            position = np.array((camera.get("pos") or "0 0 0").split(), dtype=float)
            given = camera.get("quat")
            quaternion = (
                np.array(IDENTITY_QUATERNION)
                if given is None
                else from_wxyz(normalized(np.array(given.split(), float)))
            )
            name = camera.get("name") or "camera"
            found.append(
                CameraFrame(name=name, link=body.get("name") or "", position=position, quaternion=quaternion)
            )
    return tuple(found)

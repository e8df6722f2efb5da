"""Joints that close loops of links, as `<connect>` and `<weld>` between sites."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from roboyard.description.loops import points_of
from roboyard.description.model import RobotDescription
from roboyard.export.mjcf.xml import add, pose


def add_loops(root: ET.Element, description: RobotDescription, names: Mapping[str, str]) -> None:
    """Add the loop joints, with a site in each link for each point that they keep together.

    Args:
        root: `<mujoco>`, with its bodies.
        description: the robot.
        names: link to body.
    """
    if not description.loops:
        return
    bodies = {body.get("name"): body for body in root.iter("body")}
    parent = root.find("equality")
    parent = add(root, "equality") if parent is None else parent
    for loop in description.loops:
        ends = ((loop.first, loop.first_origin), (loop.second, loop.second_origin))
        for number, shift in enumerate(points_of(loop)):
            sites = []
            for side, (link, origin) in zip("ab", ends, strict=True):
                sites.append(f"{loop.name}_loop_{number}{side}")
                place = np.asarray(origin.position) + origin.matrix()[:3, :3] @ np.asarray(shift)
                site = add(
                    bodies[names[link]],
                    "site",
                    name=sites[-1],
                    size=0.001,
                    group=5,
                    **pose(place, origin.quaternion),
                )
                body = bodies[names[link]]
                body.remove(site)
                body.insert(0, site)
            add(
                parent,
                "weld" if loop.type == "fixed" else "connect",
                name=f"{loop.name}_loop_{number}",
                site1=sites[0],
                site2=sites[1],
                solref=(0.005, 1),
                solimp=(0.99, 0.999, 0.001, 0.5, 2),
            )

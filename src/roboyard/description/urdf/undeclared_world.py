"""The link "world", which joints of Drake's and MuJoCo's URDF files name without declaring it."""

from __future__ import annotations

import xml.etree.ElementTree as ET

WORLD = "world"


def with_declared_world(root: ET.Element) -> tuple[str, ...]:
    """Add the empty link "world" where a joint of a `<robot>` has it as parent and no link has its name.

    Drake (drake.mit.edu, multibody parsing) and MuJoCo read such joints as mounts in the world; ROS refuses
    them.

    Args:
        root: changed in place.

    Returns:
        A note if the link was added.
    """
    if root.tag != "robot" or any(link.get("name") == WORLD for link in root.findall("link")):
        return ()
    for joint in root.findall("joint"):
        parent = joint.find("parent")
        if parent is not None and parent.get("link") == WORLD:
            link = type(joint)("link", {"name": WORLD})
            link.tail = "\n"
            root.insert(list(root).index(joint), link)
            return (f'<link name="world"/> is missing, the parent of joint "{joint.get("name")}"; added',)
    return ()

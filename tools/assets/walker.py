"""`walker/walker.urdf`: a quadruped of twelve joints; all collision shapes are primitives.

The calf and thigh are equally long, so that a foot below its hip needs a knee of twice the hip's angle.
"""

from __future__ import annotations

from math import pi

from assets.files import obj
from assets.mesh import Mesh, merge
from assets.palette import pick
from assets.solids import ball, drum, mirrored, rounded_box
from assets.urdf import (
    HEADER,
    Joint,
    Link,
    Shape,
    box,
    box_inertial,
    cylinder,
    cylinder_inertial,
    document,
    mesh,
    sphere,
    sphere_inertial,
)

HALF_LENGTH, HALF_WIDTH = 0.19, 0.06
"""Where the hips are in the trunk (m)."""
OFFSET = 0.08
"""From the hip's axis of rolling to the leg (m)."""
SEGMENT = 0.2
"""Length of thigh and calf (m)."""
FOOT = 0.022
"""Radius of a foot (m)."""
EFFORT, SPEED = 33.0, 20.0
"""Limits of every joint (N m, rad/s)."""
ARMATURE_NOTE = "Joint limits are those of small direct-drive motors with a gear of about 6."


def build() -> dict[str, bytes]:
    """Return every file of the robot by its path under the assets folder."""
    meshes = {"trunk": _trunk(), "hip": _hip(), "thigh": _thigh(), "calf": _calf()}
    meshes["foot"] = ball(FOOT, 20, 10)
    files = {
        f"walker/meshes/{name}.obj": obj(m, header=f"{HEADER}. Walker: {name}.") for name, m in meshes.items()
    }
    about = f"Quadruped; x forward, base_link in the middle of the trunk. {ARMATURE_NOTE}"
    colors = pick("shell", "graphite", "amber", "rubber")
    files["walker/walker.urdf"] = document("walker", _links(), _joints(), colors, about)
    return files


def _part(name: str, material: str, rpy: tuple[float, float, float] = (0, 0, 0)) -> Shape:
    return Shape(geometry=mesh(f"meshes/{name}.obj"), material=material, rpy=rpy)


def _legs() -> list[tuple[str, int, int]]:
    """Name, sign along x and sign along y of each leg."""
    return [("front_left", 1, 1), ("front_right", 1, -1), ("rear_left", -1, 1), ("rear_right", -1, -1)]


def _links() -> list[Link]:
    links = [
        Link(
            name="base_link",
            inertial=box_inertial(6.0, (0.36, 0.16, 0.1)),
            visuals=[_part("trunk", "shell")],
            collisions=[Shape(geometry=box(0.4, 0.16, 0.1))],
        )
    ]
    for leg, _, side in _legs():
        links += [
            Link(
                name=f"{leg}_hip",
                inertial=cylinder_inertial(0.6, 0.045, 0.06, "y", (0, side * 0.03, 0)),
                visuals=[_part("hip", "graphite", (0, 0, 0 if side > 0 else pi))],
            ),
            Link(
                name=f"{leg}_thigh",
                inertial=cylinder_inertial(0.9, 0.03, SEGMENT, "z", (0, 0, -0.06)),
                visuals=[_part("thigh", "amber")],
                collisions=[Shape(geometry=cylinder(0.025, 0.14), xyz=(0, 0, -SEGMENT / 2))],
            ),
            Link(
                name=f"{leg}_calf",
                inertial=cylinder_inertial(0.18, 0.012, SEGMENT, "z", (0, 0, -0.09)),
                visuals=[_part("calf", "graphite")],
                collisions=[Shape(geometry=cylinder(0.012, 0.13), xyz=(0, 0, -SEGMENT / 2))],
            ),
            Link(
                name=f"{leg}_foot",
                inertial=sphere_inertial(0.04, FOOT),
                contact={"lateral_friction": 1.0},
                visuals=[_part("foot", "rubber")],
                collisions=[Shape(geometry=sphere(FOOT))],
            ),
        ]
    return links


def _joints() -> list[Joint]:
    joints: list[Joint] = []
    limit = {"effort": EFFORT, "velocity": SPEED}
    dynamics = {"damping": 0.05, "friction": 0.1}
    for leg, along, side in _legs():
        joints += [
            Joint(
                name=f"{leg}_hip_roll", kind="revolute", parent="base_link", child=f"{leg}_hip",
                xyz=(along * HALF_LENGTH, side * HALF_WIDTH, 0), axis="1 0 0",
                limit={"lower": -0.8, "upper": 0.8, **limit}, dynamics=dynamics,
            ),
            Joint(
                name=f"{leg}_hip_pitch", kind="revolute", parent=f"{leg}_hip", child=f"{leg}_thigh",
                xyz=(0, side * OFFSET, 0), axis="0 1 0",
                limit={"lower": -1.2, "upper": 2.6, **limit}, dynamics=dynamics,
            ),
            Joint(
                name=f"{leg}_knee", kind="revolute", parent=f"{leg}_thigh", child=f"{leg}_calf",
                xyz=(0, 0, -SEGMENT), axis="0 1 0",
                limit={"lower": -2.7, "upper": -0.5, **limit}, dynamics=dynamics,
            ),
            Joint(
                name=f"{leg}_foot_joint", kind="fixed", parent=f"{leg}_calf", child=f"{leg}_foot",
                xyz=(0, 0, -SEGMENT),
            ),
        ]  # fmt: skip
    return joints


def _trunk() -> Mesh:
    body = rounded_box((0.19, 0.07, 0.045), 0.03, 4)
    nose = rounded_box((0.03, 0.045, 0.025), 0.015, 3).moved((0.2, 0, 0.0))
    rail = mirrored(rounded_box((0.13, 0.008, 0.008), 0.005, 2).moved((0, 0.055, 0.05)))
    return merge(body, nose, rail)


def _hip() -> Mesh:
    motor = drum(0.045, -0.03, 0.03, 0.006, 32).moved(rpy=(0, pi / 2, 0))
    arm = drum(0.04, 0.02, OFFSET + 0.02, 0.006, 32).moved(rpy=(-pi / 2, 0, 0))
    return merge(motor, arm)


def _thigh() -> Mesh:
    joint = drum(0.042, -0.024, 0.024, 0.006, 32).moved(rpy=(pi / 2, 0, 0))
    beam = rounded_box((0.024, 0.016, SEGMENT / 2), 0.012, 3).moved((0, 0, -SEGMENT / 2))
    knee = drum(0.026, -0.02, 0.02, 0.005, 28).moved(rpy=(pi / 2, 0, 0)).moved((0, 0, -SEGMENT))
    return merge(joint, beam, knee)


def _calf() -> Mesh:
    knee = drum(0.022, -0.014, 0.014, 0.004, 24).moved(rpy=(pi / 2, 0, 0))
    beam = rounded_box((0.012, 0.011, SEGMENT / 2 - 0.005), 0.009, 3).moved((0, 0, -SEGMENT / 2))
    return merge(knee, beam)

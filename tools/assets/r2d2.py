"""`r2d2.urdf`: a round droid on two legs and four wheels, with a gripper that slides out of its chest.

The joint table (names, types, limits, axes, frames, efforts, velocities) is the published one of the classic
example of that name; shapes, colours and masses are new. 1.57075 is the table's own quarter turn.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from assets.files import obj
from assets.mesh import Mesh, merge
from assets.palette import pick
from assets.solids import (
    arrayed,
    bend,
    dome,
    drum,
    hoop,
    loft,
    mirrored,
    plate,
    revolve,
    ring,
    rounded_box,
    tube,
)
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

QUARTER = "0 1.57075 0"
SWIVEL = {"lower": -0.38, "upper": 0.0, "effort": 1000.0, "velocity": 0.5}
FINGER = {"lower": 0.0, "upper": 0.548, "effort": 1000.0, "velocity": 0.5}


def build() -> dict[str, bytes]:
    """Return every file of the robot by its path under the assets folder."""
    meshes = {
        "body shell": _body(), "body trim": _body_trim(), "head shell": _head(), "head trim": _head_trim(),
        "leg": _leg(), "leg trim": _leg_trim(), "foot": _foot(), "tyre": _tyre(), "hub": _hub(),
        "eye": _eye(), "lens": _lens(), "pole": _pole(), "finger": _finger(), "tip": _tip(),
    }  # fmt: skip
    meshes["lights"] = _lights()
    files = {
        f"r2d2/{name.replace(' ', '_')}.obj": obj(m, header=f"{HEADER}. Droid: {name}.")
        for name, m in meshes.items()
    }
    links = [
        Link(
            name="base_link",
            inertial=cylinder_inertial(10.0, 0.2, 0.6),
            visuals=[_part("body_shell", "shell"), _part("body_trim", "teal"), _part("lights", "amber")],
            collisions=[Shape(geometry=cylinder(0.2, 0.6))],
        ),
        *_side("right"),
        *_side("left"),
        Link(
            name="gripper_pole",
            inertial=box_inertial(0.3, (0.2, 0.03, 0.03), xyz="0 0 0"),
            visuals=[_part("pole", "metal")],
            collisions=[Shape(geometry=cylinder(0.012, 0.2), xyz="0.1 0 0", rpy=QUARTER)],
        ),
        *_gripper("left"),
        *_gripper("right"),
        Link(
            name="head",
            inertial=sphere_inertial(2.0, 0.2),
            visuals=[_part("head_shell", "teal"), _part("head_trim", "shell")],
            collisions=[Shape(geometry=sphere(0.2))],
        ),
        Link(
            name="box",
            inertial=box_inertial(0.2, (0.08, 0.08, 0.08)),
            visuals=[_part("eye", "graphite"), _part("lens", "glow")],
            collisions=[Shape(geometry=box(0.08, 0.08, 0.08))],
        ),
    ]
    joints = [
        *_side_joints("right", "0.22 0 0.25"),
        *_side_joints("left", "-0.22 0 0.25"),
        Joint(name="gripper_extension", kind="prismatic", parent="base_link", child="gripper_pole",
              xyz="0 0.19 0.2", rpy="0 0 1.57075", axis="1 0 0", limit=SWIVEL),
        Joint(name="left_gripper_joint", kind="revolute", parent="gripper_pole", child="left_gripper",
              xyz="0.2 0.02 0", axis="0 0 1", limit=FINGER),
        Joint(name="left_tip_joint", kind="fixed", parent="left_gripper", child="left_tip"),
        Joint(name="right_gripper_joint", kind="revolute", parent="gripper_pole", child="right_gripper",
              xyz="0.2 -0.02 0", axis="0 0 -1", limit=FINGER),
        Joint(name="right_tip_joint", kind="fixed", parent="right_gripper", child="right_tip"),
        Joint(name="head_swivel", kind="revolute", parent="base_link", child="head", xyz="0 0 0.3",
              axis="0 0 1", limit=SWIVEL),
        Joint(name="tobox", kind="fixed", parent="head", child="box", xyz="0 0.1214 0.1214"),
    ]  # fmt: skip
    materials = pick("shell", "teal", "amber", "graphite", "rubber", "metal", "glow")
    about = "Droid on four wheels; it faces +y, its right side is +x."
    files["r2d2.urdf"] = document("r2d2", links, joints, materials, about)
    return files


def _part(name: str, material: str, **placement: str) -> Shape:
    return Shape(geometry=mesh(f"r2d2/{name}.obj"), material=material, **placement)


def _side(side: str) -> list[Link]:
    turned = {} if side == "right" else {"rpy": "0 0 3.1415927"}
    leg = Link(
        name=f"{side}_leg",
        inertial=box_inertial(2.0, (0.6, 0.1, 0.2), xyz="0 0 -0.3", rpy=QUARTER),
        visuals=[_part("leg", "shell", **turned), _part("leg_trim", "teal", **turned)],
        collisions=[Shape(geometry=box(0.6, 0.1, 0.2), xyz="0 0 -0.3", rpy=QUARTER)],
    )
    foot = Link(
        name=f"{side}_base",
        inertial=box_inertial(4.0, (0.1, 0.4, 0.1)),
        visuals=[_part("foot", "shell")],
        collisions=[Shape(geometry=box(0.1, 0.4, 0.1))],
    )
    wheels = [
        Link(
            name=f"{side}_{end}_wheel",
            inertial=cylinder_inertial(0.8, 0.035, 0.1),
            contact={"lateral_friction": 1.0},
            visuals=[_part("tyre", "rubber"), _part("hub", "metal")],
            collisions=[Shape(geometry=cylinder(0.035, 0.1))],
        )
        for end in ("front", "back")
    ]
    return [leg, foot, *wheels]


def _side_joints(side: str, hip: str) -> list[Joint]:
    wheels = [
        Joint(
            name=f"{side}_{end}_wheel_joint", kind="continuous", parent=f"{side}_base",
            child=f"{side}_{end}_wheel", xyz=f"0 {y} -0.085", rpy=QUARTER, axis="0 0 1",
            limit={"effort": 100.0, "velocity": 100.0},
        )
        for end, y in (("front", "0.133333333333"), ("back", "-0.133333333333"))
    ]  # fmt: skip
    return [
        Joint(name=f"base_to_{side}_leg", kind="fixed", parent="base_link", child=f"{side}_leg", xyz=hip),
        Joint(
            name=f"{side}_base_joint",
            kind="fixed",
            parent=f"{side}_leg",
            child=f"{side}_base",
            xyz="0 0 -0.6",
        ),
        *wheels,
    ]


def _gripper(side: str) -> list[Link]:
    turned = "0 0 0" if side == "left" else "3.1415927 0 0"
    return [
        Link(
            name=f"{side}_gripper",
            inertial=box_inertial(0.1, (0.05, 0.02, 0.03)),
            visuals=[_part("finger", "graphite", rpy=turned)],
            collisions=[Shape(geometry=box(0.08, 0.015, 0.03), xyz="0.04 0 0")],
        ),
        Link(
            name=f"{side}_tip",
            inertial=box_inertial(0.05, (0.05, 0.02, 0.03)),
            visuals=[_part("tip", "amber", rpy=turned)],
            collisions=[Shape(geometry=box(0.03, 0.012, 0.03), xyz="0.095 0 0")],
        ),
    ]


def _body() -> Mesh:
    return revolve([(0.10, -0.33), (0.14, -0.325), (0.175, -0.305), (0.192, -0.28), (0.2, -0.25),
                    (0.2, -0.215),
                  (0.193, -0.212), (0.193, -0.203), (0.2, -0.2), (0.2, 0.225), (0.193, 0.228), (0.193, 0.237),
                  (0.2, 0.24), (0.2, 0.29), (0.195, 0.297), (0.185, 0.3)], 48)  # fmt: skip


def _curved(mesh: Mesh, radius: float) -> Mesh:
    """Return a flat piece in the xz plane (facing +y) bent around the vertical axis at `radius`."""
    v = mesh.vertices.copy()
    angle = v[:, 0] / radius
    r = radius + v[:, 1]
    out = np.column_stack([r * np.sin(angle), r * np.cos(angle), v[:, 2]])
    return Mesh(vertices=out, faces=mesh.faces)


def _tile(x: float, z: float, half_x: float, half_z: float, proud: float = 0.005) -> Mesh:
    """Return a raised panel on the body's surface."""
    strips = max(1, round(half_x / 0.01))
    width = 2 * half_x / strips
    edges = [x - half_x + i * width for i in range(strips + 1)]
    pieces = [
        plate([(a, -proud), (b, -proud), (b, proud), (a, proud)], z - half_z, z + half_z)
        for a, b in pairwise(edges)
    ]
    return _curved(merge(*pieces), 0.2)


def _body_trim() -> Mesh:
    bands = merge(ring(0.203, 0.012, 0.262, 0.28, 48), ring(0.203, 0.012, -0.262, -0.232, 48))
    hatch = merge(
        _tile(0, 0.06, 0.075, 0.055), _tile(-0.045, -0.06, 0.03, 0.045), _tile(0.045, -0.06, 0.03, 0.045)
    )
    vents = merge(*(_tile(0, -0.135 - 0.022 * i, 0.075, 0.006) for i in range(3)))
    sides = merge(*(_tile(s * 0.16, z, 0.025, 0.012) for s in (-1, 1) for z in (0.2, 0.165, 0.13)))
    back = merge(
        _tile(0.628, 0.05, 0.09, 0.1), *(_tile(0.628, -0.1 - 0.03 * i, 0.09, 0.008) for i in range(3))
    )
    return merge(bands, hatch, vents, sides, back)


def _lights() -> Mesh:
    spots = [
        drum(0.011, 0, 0.012, 0.003, 16).moved((x, 0, z), (-1.5707963, 0, 0))
        for x, z in ((-0.05, 0.155), (0.05, 0.155), (0.1, 0.06), (0.1, 0.03))
    ]
    return _curved(merge(*spots), 0.199)


def _head() -> Mesh:
    return merge(dome(0.2, 0.185, 48, 9).moved((0, 0, 0.01)), drum(0.2, 0.0, 0.014, 0.004, 48, 1))


def _head_trim() -> Mesh:
    crown = revolve(
        [(0.0, 0.17), (0.075, 0.176), (0.078, 0.182), (0.07, 0.19), (0.04, 0.2), (0.0, 0.202)], 32
    )
    aerial = tube([(-0.07, -0.08, 0.12), (-0.07, -0.08, 0.27)], 0.005, 10)
    bulb = revolve([(0.0, -0.012), (0.008, -0.009), (0.012, 0), (0.008, 0.009), (0.0, 0.012)], 16).moved(
        (-0.07, -0.08, 0.28)
    )
    seam = ring(0.2, 0.02, 0.045, 0.058, 48).scaled(0.987, 0.987, 1)
    return merge(crown, aerial, bulb, seam)


def _eye() -> Mesh:
    barrel = revolve(
        [
            (0.0, -0.08),
            (0.05, -0.08),
            (0.052, 0.03),
            (0.048, 0.042),
            (0.04, 0.044),
            (0.036, 0.034),
            (0.0, 0.034),
        ],
        32,
    )
    return barrel.moved(rpy=(-1.35, 0, 0))


def _lens() -> Mesh:
    glass = revolve([(0.0, 0.03), (0.035, 0.034), (0.024, 0.043), (0.012, 0.047), (0.0, 0.048)], 24)
    return glass.moved(rpy=(-1.35, 0, 0))


def _leg() -> Mesh:
    """Return the right leg: a slab with a round shoulder, its outer face at +x."""
    sections = [(-0.58, 0.042, 0.085), (-0.42, 0.034, 0.05), (-0.12, 0.036, 0.062), (0.0, 0.04, 0.085)]
    slab = loft([(z, 0, 0, half_x, half_y, 0.02) for z, half_x, half_y in sections], 3, 0.008)
    shoulder = drum(0.1, -0.045, 0.05, 0.014, 36).moved(rpy=(0, 1.5707963, 0))
    return merge(slab, shoulder)


def _leg_trim() -> Mesh:
    cap = drum(0.06, 0.04, 0.06, 0.006, 32).moved(rpy=(0, 1.5707963, 0))
    ribs = merge(
        *(rounded_box((0.004, 0.03, 0.007), 0.003, 1).moved((0.036, 0, z)) for z in (-0.24, -0.27, -0.3))
    )
    piston = mirrored(tube([(0.0, 0.062, -0.5), (0.0, 0.052, -0.25)], 0.012, 12))
    return merge(cap, ribs, piston)


def _foot() -> Mesh:
    shell = loft(
        [(-0.055, 0, 0, 0.055, 0.205, 0.02), (-0.01, 0, 0, 0.056, 0.2, 0.02), (0.05, 0, 0, 0.05, 0.1, 0.02)],
        3,
        0.01,
    )
    return merge(shell, mirrored(rounded_box((0.035, 0.012, 0.01), 0.006, 2).moved((0, 0.2, -0.03))))


def _tyre() -> Mesh:
    tyre = hoop(
        [(0.02, -0.05), (0.029, -0.05), (0.035, -0.044), (0.035, 0.044), (0.029, 0.05), (0.02, 0.05)], 32
    )
    lug = rounded_box((0.0025, 0.0025, 0.042), 0.001, 1).moved((0.0335, 0, 0))
    return merge(tyre, arrayed(lug, 20))


def _hub() -> Mesh:
    cap = drum(0.018, -0.054, 0.054, 0.004, 20)
    bolts = arrayed(mirrored(drum(0.003, 0.048, 0.056, 0.001, 8, 1), "z").moved((0.0115, 0, 0)), 5)
    return merge(cap, bolts)


def _pole() -> Mesh:
    rod = drum(0.012, -0.12, 0.19, 0.003, 20).moved(rpy=(0, 1.5707963, 0))
    sleeve = drum(0.018, -0.12, 0.02, 0.004, 20).moved(rpy=(0, 1.5707963, 0))
    yoke = rounded_box((0.016, 0.034, 0.016), 0.007, 2).moved((0.195, 0, 0))
    return merge(rod, sleeve, yoke)


def _finger() -> Mesh:
    bar = bend([(0, 0, 0), (0.03, 0.022, 0), (0.075, 0.012, 0)], 0.016, 3)
    return merge(tube(bar, 0.008, 12), drum(0.011, -0.018, 0.018, 0.003, 16))


def _tip() -> Mesh:
    return rounded_box((0.022, 0.007, 0.014), 0.005, 2).moved((0.092, 0.001, 0), (0, 0, -0.22))

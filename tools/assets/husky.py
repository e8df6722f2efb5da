"""`husky/husky.urdf`: a four-wheeled skid-steer rover with bumpers and a sensor rail.

The joint table is the published one of the classic example of that name; shapes, colours and masses are new.
"""

from __future__ import annotations

from math import pi

from assets.files import obj
from assets.mesh import Mesh, merge
from assets.palette import pick
from assets.solids import arrayed, bend, drum, hoop, loft, mirrored, plate, revolve, rounded_box, tube
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
)

CHASSIS_COM = "-0.08748 -0.00085 0.09947"
WHEEL_RADIUS = 0.174
"""m"""
WHEEL_WIDTH = 0.128
"""m"""
WHEELS = {
    "front_left": "0.256 0.2854 0.03282",
    "front_right": "0.256 -0.2854 0.03282",
    "rear_left": "-0.256 0.2854 0.03282",
    "rear_right": "-0.256 -0.2854 0.03282",
}


def build() -> dict[str, bytes]:
    """Return every file of the robot by its path under the assets folder."""
    meshes = {
        "chassis": _chassis(), "chassis_trim": _trim(), "lamps": _lamps(), "tyre": _tyre(), "rim": _rim(),
        "top_plate": _top_plate(), "user_rail": _rail(), "bumper": _bumper(), "imu": _imu(),
    }  # fmt: skip
    files = {
        f"husky/meshes/{name}.obj": obj(m, header=f"{HEADER}. Rover: {name.replace('_', ' ')}.")
        for name, m in meshes.items()
    }
    files["husky/husky.urdf"] = document(
        "husky", _links(), _joints(), pick("amber", "graphite", "rubber", "metal", "glow", "shell"),
        "Skid-steer rover; x forward, base_footprint on the ground under its middle.",
    )  # fmt: skip
    return files


def _part(name: str, material: str, **placement: str) -> Shape:
    return Shape(geometry=mesh(f"meshes/{name}.obj"), material=material, **placement)


def _links() -> list[Link]:
    chassis = Link(
        name="base_link",
        inertial=box_inertial(36.0, (0.8, 0.45, 0.2), xyz=CHASSIS_COM),
        visuals=[_part("chassis", "amber"), _part("chassis_trim", "graphite"), _part("lamps", "glow")],
        collisions=[
            Shape(geometry=box(0.95, 0.5, 0.235), xyz="0 0 0.1275"),
        ],
    )
    wheels = [
        Link(
            name=f"{name}_wheel_link",
            inertial=cylinder_inertial(3.0, WHEEL_RADIUS, WHEEL_WIDTH, "y"),
            contact={"lateral_friction": 1.0},
            visuals=[_part("tyre", "rubber"), _part("rim", "metal")],
            collisions=[Shape(geometry=cylinder(WHEEL_RADIUS, WHEEL_WIDTH), rpy="1.570795 0 0")],
        )
        for name in WHEELS
    ]
    bumpers = [
        Link(
            name=f"{end}_bumper_link",
            inertial=box_inertial(1.0, (0.09, 0.5, 0.08), xyz="0 0 0"),
            visuals=[_part("bumper", "graphite")],
        )
        for end in ("front", "rear")
    ]
    return [
        Link(name="base_footprint", inertial=box_inertial(1.0, (0.1, 0.1, 0.1)), note="On the ground."),
        chassis,
        Link(
            name="imu_link", inertial=box_inertial(0.1, (0.04, 0.04, 0.02)), visuals=[_part("imu", "shell")]
        ),
        *wheels,
        Link(
            name="top_plate_link",
            inertial=box_inertial(1.5, (0.7, 0.42, 0.01), xyz="0 0 0.245"),
            visuals=[_part("top_plate", "graphite")],
        ),
        Link(
            name="user_rail_link",
            inertial=box_inertial(1.0, (0.04, 0.4, 0.2), xyz="0 0 0.1"),
            visuals=[_part("user_rail", "metal")],
        ),
        *bumpers,
    ]


def _joints() -> list[Joint]:
    def fixed(name: str, child: str, xyz: str, parent: str = "base_link", rpy: str = "0 0 0") -> Joint:
        return Joint(name=name, kind="fixed", parent=parent, child=child, xyz=xyz, rpy=rpy)

    wheels = [
        Joint(
            name=f"{name}_wheel",
            kind="continuous",
            parent="base_link",
            child=f"{name}_wheel_link",
            xyz=xyz,
            axis="0 1 0",
        )
        for name, xyz in WHEELS.items()
    ]
    return [
        fixed("chassis_joint", "base_link", "0 0 0.14493", "base_footprint"),
        fixed("imu_joint", "imu_link", "0 0 0.19"),
        *wheels,
        fixed("top_plate", "top_plate_link", "0 0 0"),
        fixed("user_rail", "user_rail_link", "0.272 0 0.245"),
        fixed("front_bumper", "front_bumper_link", "0.48 0 0.091"),
        fixed("rear_bumper", "rear_bumper_link", "-0.48 0 0.091", rpy="0 0 3.14159"),
    ]


def _profile() -> list[tuple[float, float]]:
    """Return the side view (x, z) of the hull, counter-clockwise."""
    front = [(0.36, -0.005), (0.40, 0.02), (0.468, 0.105), (0.462, 0.15), (0.40, 0.235), (0.36, 0.245)]
    return front + [(-x, z) for x, z in reversed(front)]


def _chassis() -> Mesh:
    """Return the body between the wheels and the covers over them."""
    side_on = (pi / 2, 0.0, 0.0)
    hull = plate(_profile(), -0.19, 0.19, 0.018).moved(rpy=side_on)
    cover = loft(
        [(0.2, 0, 0, 0.455, 0.285, 0.06), (0.235, 0, 0, 0.45, 0.278, 0.06), (0.247, 0, 0, 0.42, 0.25, 0.05)],
        4,
        0.006,
    )
    return merge(hull, cover)


def _trim() -> Mesh:
    skirt = mirrored(rounded_box((0.44, 0.012, 0.03), 0.008, 2).moved((0, 0.283, 0.213)))
    axles = merge(
        *(drum(0.045, -0.24, 0.24, 0.006, 24).moved((x, 0, 0.03282), (pi / 2, 0, 0)) for x in (0.256, -0.256))
    )
    grille = merge(
        *(
            rounded_box((0.004, 0.11, 0.006), 0.002, 1).moved(
                (s * (0.448 - 0.0165 * i), 0, 0.165 + 0.018 * i), (0, -s * 0.65, 0)
            )
            for s in (1, -1)
            for i in range(3)
        )
    )
    belly = rounded_box((0.33, 0.17, 0.01), 0.006, 2).moved((0, 0, -0.008))
    side = mirrored(rounded_box((0.09, 0.006, 0.05), 0.004, 2).moved((0, 0.19, 0.1)))
    return merge(skirt, axles, grille, belly, side)


def _lamps() -> Mesh:
    lamp = drum(0.028, 0, 0.012, 0.004, 24).moved((0.449, 0.145, 0.165), (0, pi / 2 - 0.65, 0))
    return merge(lamp, lamp.scaled(1, -1, 1))


def _tyre() -> Mesh:
    """Return a tyre about y; chevron lugs extend to the rolling radius."""
    r, w = WHEEL_RADIUS, WHEEL_WIDTH / 2
    wall = [(0.1, -w + 0.006), (0.115, -w), (0.15, -w), (r - 0.02, -w + 0.008), (r - 0.01, -w + 0.02)]
    core = hoop(wall + [(radius, -z) for radius, z in reversed(wall)], 48)
    bar = rounded_box((0.009, 0.008, w * 0.56), 0.003, 1)
    half = bar.moved((r - 0.0095, 0.012, w * 0.46), (0.5, 0, 0))
    other = half.scaled(1, 1, -1)
    lugs = merge(arrayed(half, 20), arrayed(other, 20, pi / 20))
    return merge(core, lugs).moved(rpy=(pi / 2, 0, 0))


def _rim() -> Mesh:
    w = WHEEL_WIDTH / 2
    side = [(0.0, -w + 0.03), (0.09, -w + 0.028), (0.1, -w + 0.004), (0.108, -w + 0.002)]
    dish = revolve(side + [(radius, -z) for radius, z in reversed(side)], 40)
    spoke = mirrored(rounded_box((0.04, 0.011, 0.009), 0.004, 1).moved((0.055, 0, w - 0.024)), "z")
    hub = drum(0.032, -w - 0.002, w + 0.002, 0.006, 24)
    bolts = arrayed(mirrored(drum(0.004, w - 0.004, w + 0.006, 0.001, 6, 1), "z").moved((0.02, 0, 0)), 5)
    return merge(dish, arrayed(spoke, 6), hub, bolts).moved(rpy=(pi / 2, 0, 0))


def _top_plate() -> Mesh:
    deck = loft([(0.245, 0, 0, 0.33, 0.2, 0.03), (0.257, 0, 0, 0.33, 0.2, 0.03)], 4, 0.004)
    bolts = [
        drum(0.009, 0.255, 0.262, 0.002, 10, 1).moved((x, y, 0))
        for x in (-0.29, 0, 0.29)
        for y in (-0.165, 0.165)
    ]
    slots = [
        rounded_box((0.1, 0.012, 0.003), 0.0025, 1).moved((x, y, 0.258))
        for x in (-0.15, 0.15)
        for y in (-0.08, 0, 0.08)
    ]
    return merge(deck, *bolts, *slots)


def _rail() -> Mesh:
    """Return a roll bar with a sensor shelf."""
    arch = tube(
        bend([(0, -0.19, 0.0), (0, -0.19, 0.17), (0, 0.19, 0.17), (0, 0.19, 0.0)], 0.05, 5), 0.014, 14
    )
    stays = mirrored(tube([(-0.12, 0.19, 0.0), (0, 0.19, 0.12)], 0.011, 12))
    feet = mirrored(
        merge(
            drum(0.024, -0.002, 0.012, 0.003, 16).moved((0, 0.19, 0)),
            drum(0.02, -0.002, 0.012, 0.003, 16).moved((-0.12, 0.19, 0)),
        )
    )
    shelf = rounded_box((0.045, 0.08, 0.007), 0.005, 2).moved((0, 0, 0.187))
    return merge(arch, stays, feet, shelf)


def _bumper() -> Mesh:
    """Return a bar in front of the hull (towards +x); the frame is at the hull's nose."""
    bar = tube(
        bend([(-0.03, -0.24, 0), (0.045, -0.2, 0), (0.045, 0.2, 0), (-0.03, 0.24, 0)], 0.04, 4), 0.026, 14
    )
    struts = mirrored(rounded_box((0.04, 0.02, 0.014), 0.006, 2).moved((0.005, 0.11, 0)))
    return merge(bar, struts)


def _imu() -> Mesh:
    return rounded_box((0.02, 0.02, 0.01), 0.003, 2)

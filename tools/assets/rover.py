"""`rover/rover.urdf`: a round differential-drive robot with two driven wheels, a caster and a lidar."""

from __future__ import annotations

from math import pi

from assets.files import obj
from assets.mesh import Mesh, merge
from assets.palette import pick
from assets.solids import arrayed, ball, drum, hoop, loft, mirrored, plate, revolve, rounded_box
from assets.urdf import (
    HEADER,
    Joint,
    Link,
    Shape,
    cylinder,
    cylinder_inertial,
    document,
    mesh,
    mesh_inertial,
    sphere,
    sphere_inertial,
)

WHEEL_RADIUS, WHEEL_WIDTH = 0.075, 0.03
AXLE = 0.3
"""Distance between the wheels' middles; m"""
CASTER_RADIUS = 0.03
MIDDLE = -0.045
"""Position of the body's centre, behind the axle, so that the caster is loaded (m)."""


def build() -> dict[str, bytes]:
    """Return every file of the robot by its path under the assets folder."""
    meshes = {
        "shell": _behind(_shell()), "trim": _behind(_trim()), "lights": _behind(_lights()), "tyre": _tyre(),
        "rim": _rim(), "lidar": _lidar(), "caster": ball(CASTER_RADIUS, 20, 10),
    }  # fmt: skip
    files = {
        f"rover/meshes/{name}.obj": obj(m, header=f"{HEADER}. Rover: {name}.") for name, m in meshes.items()
    }
    about = "Differential-drive robot; x forward, base_link on the floor between the wheels."
    colors = pick("blue", "graphite", "glow", "rubber", "metal", "shell")
    files["rover/rover.urdf"] = document("rover", _links(), _joints(), colors, about)
    return files


def _part(name: str, material: str) -> Shape:
    return Shape(geometry=mesh(f"meshes/{name}.obj"), material=material)


def _links() -> list[Link]:
    wheels = [
        Link(
            name=f"{side}_wheel",
            inertial=cylinder_inertial(0.8, WHEEL_RADIUS, WHEEL_WIDTH, "y"),
            contact={"lateral_friction": 1.0},
            visuals=[_part("tyre", "rubber"), _part("rim", "metal")],
            collisions=[Shape(geometry=cylinder(WHEEL_RADIUS, WHEEL_WIDTH), rpy=(pi / 2, 0, 0))],
        )
        for side in ("left", "right")
    ]
    return [
        Link(
            name="base_link",
            inertial=mesh_inertial(9.0, _behind(_shell()), _behind(_trim())),
            visuals=[_part("shell", "blue"), _part("trim", "graphite"), _part("lights", "glow")],
            collisions=[Shape(geometry=cylinder(0.2, 0.1), xyz=(MIDDLE, 0, 0.11))],
        ),
        *wheels,
        Link(
            name="caster",
            inertial=sphere_inertial(0.2, CASTER_RADIUS),
            contact={"lateral_friction": 0.01},
            visuals=[_part("caster", "metal")],
            collisions=[Shape(geometry=sphere(CASTER_RADIUS))],
            note="Slides: its friction is next to nothing.",
        ),
        Link(
            name="lidar",
            inertial=cylinder_inertial(0.2, 0.036, 0.04),
            visuals=[_part("lidar", "graphite")],
            collisions=[Shape(geometry=cylinder(0.036, 0.04))],
        ),
    ]


def _joints() -> list[Joint]:
    wheels = [
        Joint(
            name=f"{side}_wheel_joint", kind="continuous", parent="base_link", child=f"{side}_wheel",
            xyz=(0, way * AXLE / 2, WHEEL_RADIUS), axis="0 1 0", limit={"effort": 8.0, "velocity": 25.0},
            dynamics={"damping": 0.01, "friction": 0.01},
        )
        for side, way in (("left", 1), ("right", -1))
    ]  # fmt: skip
    return [
        *wheels,
        Joint(
            name="caster_joint", kind="fixed", parent="base_link", child="caster",
            xyz=(MIDDLE - 0.13, 0, CASTER_RADIUS),
        ),
        Joint(name="lidar_joint", kind="fixed", parent="base_link", child="lidar", xyz=(MIDDLE, 0, 0.198)),
    ]  # fmt: skip


def _behind(solid: Mesh) -> Mesh:
    return solid.moved((MIDDLE, 0, 0))


def _shell() -> Mesh:
    outer = [(0.0, 0.165), (0.1, 0.168), (0.165, 0.162), (0.19, 0.148), (0.2, 0.125), (0.2, 0.092)]
    return revolve(list(reversed(outer)), 56)


def _trim() -> Mesh:
    belly = revolve([(0.13, 0.04), (0.17, 0.045), (0.196, 0.065), (0.196, 0.094)], 48)
    bumper = hoop(
        [(0.204, 0.07), (0.207, 0.075), (0.207, 0.085), (0.204, 0.09), (0.19, 0.09), (0.19, 0.07)], 56
    )
    post = revolve([(0.05, 0.16), (0.04, 0.168), (0.034, 0.18)], 32)
    deck = loft([(0.163, -0.1, 0, 0.045, 0.07, 0.02), (0.172, -0.1, 0, 0.044, 0.069, 0.02)], 4, 0.003, 2)
    fork = merge(drum(0.035, 0.03, 0.05, 0.004, 20), drum(0.012, 0.03, 0.06, 0.003, 12)).moved((-0.13, 0, 0))
    return merge(belly, bumper, post, deck, fork)


def _lights() -> Mesh:
    lamp = rounded_box((0.006, 0.022, 0.006), 0.005, 2)
    return mirrored(lamp.moved((0.196, 0, 0.122)).moved(rpy=(0, 0, 0.3)))


def _tyre() -> Mesh:
    r, w = WHEEL_RADIUS, WHEEL_WIDTH / 2
    side = [(0.05, -w + 0.003), (0.056, -w), (r - 0.008, -w), (r - 0.002, -w + 0.004), (r - 0.0015, -w * 0.4)]
    core = hoop(side + [(radius, -z) for radius, z in reversed(side)], 48)
    block = rounded_box((0.0015, 0.0032, w * 0.8), 0.0008, 1).moved((r - 0.0015, 0, 0))
    return merge(core, arrayed(block, 30)).moved(rpy=(pi / 2, 0, 0))


def _rim() -> Mesh:
    w = WHEEL_WIDTH / 2
    dish = drum(0.051, -w + 0.006, w - 0.006, 0.002, 40, 1)
    arm = plate(
        [(0.012, -0.005), (0.049, -0.008), (0.049, 0.008), (0.012, 0.005)], w - 0.007, w - 0.002, 0.001
    )
    hub = drum(0.016, -w, w, 0.003, 24)
    return merge(dish, arrayed(mirrored(arm, "z"), 5), hub).moved(rpy=(pi / 2, 0, 0))


def _lidar() -> Mesh:
    head = [(0.03, -0.02), (0.036, -0.016), (0.036, -0.006), (0.033, -0.004)]
    return revolve([*head, (0.033, 0.008), (0.036, 0.01), (0.036, 0.016), (0.03, 0.02)], 36)

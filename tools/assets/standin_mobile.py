"""Stand-ins for PyBullet's moving robots: a car with steered wheels, a four-legged one, and a humanoid."""

from __future__ import annotations

from assets.palette import pick
from assets.standin import HALF, barrel, fixed, frame, hinge, slab, solid
from assets.urdf import (
    Joint,
    Link,
    Shape,
    box_inertial,
    cylinder,
    cylinder_inertial,
    document,
    sphere,
    sphere_inertial,
)

TURN = 1.57075
"""PyBullet's quarter turn of the four-legged robot's motors (rad)."""


def build() -> dict[str, bytes]:
    """Return every file of this group by its path under the assets folder."""
    return {
        "racecar/racecar.urdf": _racecar(),
        "quadruped/minitaur.urdf": _minitaur(),
        "humanoid/humanoid.urdf": _humanoid(),
    }


def _racecar() -> bytes:
    body = [
        slab((-0.06, -0.06, -0.01), (0.38, 0.06, 0.03), "graphite"),
        slab((-0.05, -0.075, 0.03), (0.2, 0.075, 0.075), "red"),
        slab((0.2, -0.07, 0.03), (0.4, 0.07, 0.05), "red"),
    ]
    links = [
        frame("base_link", 0.1),
        Link(name="chassis", inertial=box_inertial(0.1, (0.4, 0.12, 0.04)), visuals=body),
        Link(name="chassis_inertia", inertial=box_inertial(4.0, (0.4, 0.2, 0.1), xyz=(0.1477, 0, 0))),
    ]
    joints = [
        fixed("base_link_joint", "base_link", "chassis", (0, 0, 0.05)),
        fixed("chassis_inertia_joint", "chassis", "chassis_inertia"),
    ]
    quarter = 1.5708
    for side, y in (("left", 0.1), ("right", -0.1)):
        parts = _wheel(f"{side}_rear_wheel", y)
        links.append(parts)
        joints.append(
            hinge(
                f"{side}_rear_wheel_joint",
                "chassis",
                parts.name,
                (0, y, 0),
                (quarter, 0, 0),
                "0 0 -1",
                0,
                -1,
                10,
                100,
                "continuous",
            )
        )
    for side, y in (("left", 0.1), ("right", -0.1)):
        knuckle, parts = f"{side}_steering_hinge", _wheel(f"{side}_front_wheel", y)
        kind, lower, upper = ("revolute", -1, 1) if side == "left" else ("continuous", -1, 1)
        links += [frame(knuckle, 0.1), parts]
        joints += [
            hinge(
                f"{side}_steering_hinge_joint",
                "chassis",
                knuckle,
                (0.325, y, 0),
                (0, quarter, 0),
                "-1 0 0",
                lower,
                upper,
                10,
                100,
                kind,
            ),
            hinge(
                f"{side}_front_wheel_joint",
                knuckle,
                parts.name,
                "0 0 0",
                (quarter, 0, 0),
                "0 0 -1",
                0,
                -1,
                10,
                100,
                "continuous",
            ),
        ]
    links += [
        solid(
            "laser",
            0.13,
            (0, 0, 0),
            (-0.05, -0.05, -0.05),
            (0.05, 0.05, 0.05),
            [barrel(0.025, -0.03, 0.03, color="graphite")],
        ),
        solid(
            "zed_camera_link",
            1e-5,
            (0, 0, 0),
            (-0.0165, -0.0875, -0.015),
            (0.0165, 0.0875, 0.015),
            [slab((-0.0165, -0.0875, -0.015), (0.0165, 0.0875, 0.015), "metal")],
        ),
        frame("camera_link", 1e-5),
        frame("zed_camera_right_link", 1e-5),
    ]
    joints += [
        fixed("hokuyo_joint", "chassis", "laser", (0.265, 0, 0.075)),
        fixed("zed_camera_joint", "chassis", "zed_camera_link", (0.39, 0, 0.04)),
        fixed("zed_camera_left_joint", "zed_camera_link", "camera_link", (0, 0.06, 0)),
        fixed("zed_camera_right_joint", "zed_camera_link", "zed_camera_right_link", (0, -0.06, 0)),
    ]
    about = "Car with steered front wheels; PyBullet's names and frames."
    return document("racecar", links, joints, pick("graphite", "red", "rubber", "metal"), about)


def _wheel(name: str, y: float) -> Link:
    """Return a wheel that spins about z, outside of its hinge."""
    at = (0, 0, -0.0225 if y > 0 else 0.0225)
    tyre, hub = cylinder(0.05, 0.045), cylinder(0.03, 0.047)
    return Link(
        name=name,
        inertial=cylinder_inertial(0.34055, 0.05, 0.045, xyz=at),
        visuals=[
            Shape(geometry=tyre, xyz=at, material="rubber"),
            Shape(geometry=hub, xyz=at, material="metal"),
        ],
        collisions=[Shape(geometry=tyre, xyz=at)],
    )


# ------------------------------------------------------------------------------------------------- four legs


def _minitaur() -> bytes:
    base = solid(
        "base_chassis_link",
        3.0,
        (0, 0, 0),
        (-0.165, -0.15, -0.035),
        (0.165, 0.15, 0.035),
        [
            slab((-0.165, -0.05, -0.035), (0.165, 0.05, 0.035), "teal"),
            slab((-0.085, -0.15, -0.025), (0.085, 0.15, 0.025), "graphite"),
        ],
    )
    links, joints = [base], []
    for side, sign, legs in (("right", -1, ("front", "back")), ("left", 1, ("front", "back"))):
        chassis = f"chassis_{side}"
        rails = [slab((-0.17, y - 0.005, -0.02), (0.17, y + 0.005, 0.02), "metal") for y in (-0.035, 0.035)]
        links.append(solid(chassis, 0.1, (0, 0, 0), (-0.17, -0.04, -0.02), (0.17, 0.04, 0.02), rails))
        roll = 0.0872665 * sign
        joints.append(
            fixed(f"{chassis}_center", "base_chassis_link", chassis, (0, 0.1 * sign, 0), (roll, 0, 0))
        )
        for end in legs:
            for half in ("R", "L") if side == "right" else ("L", "R"):
                _half_leg(links, joints, chassis, side, end, half)
    about = "Four legs of two motors each, closed by no constraint; PyBullet's names and frames."
    return document("quadruped", links, joints, pick("teal", "graphite", "metal", "rubber"), about)


def _half_leg(links: list[Link], joints: list[Joint], chassis: str, side: str, end: str, half: str) -> None:
    """Append a motor with its upper and lower leg."""
    leg = f"{end}_{side}{half}"
    motor, upper, lower = f"motor_{leg}_link", f"upper_leg_{leg}_link", f"lower_leg_{leg}_link"
    inner = {"right": {"R": -0.025, "L": 0.04}, "left": {"L": 0.025, "R": -0.04}}[side][half]
    x = 0.21 if end == "front" else -0.21
    turn = (TURN, 0, 3.141592 if half == "L" else 0)
    drive = {"effort": 100.0, "velocity": 100.0}
    can = cylinder(0.0434, 0.026)
    links += [
        Link(
            name=motor,
            inertial=cylinder_inertial(0.25, 0.0434, 0.026),
            visuals=[Shape(geometry=can, material="graphite")],
            collisions=[Shape(geometry=can)],
        ),
        solid(
            upper,
            0.05,
            (0, 0, 0),
            (-0.005, -0.01, -0.055),
            (0.005, 0.01, 0.055),
            [slab((-0.005, -0.01, -0.055), (0.005, 0.01, 0.055), "metal")],
        ),
        solid(
            lower,
            0.05,
            (0, 0, 0),
            (-0.005, -0.005, 0),
            (0.005, 0.005, 0.2),
            [
                slab((-0.005, -0.005, 0), (0.005, 0.005, 0.19), "metal"),
                Shape(geometry=sphere(0.011), xyz=(0, 0, 0.189), material="rubber"),
            ],
            {"lateral_friction": 1.0, "stiffness": 10000.0, "damping": 10.0},
        ),
    ]
    hip = f"hip_{leg}_link" if half == "R" else f"motor_{leg}_link"
    if half == "R" and end == "back":
        hip = f"hip_{side}R_link"
    joints += [
        Joint(
            name=f"motor_{leg}_joint",
            kind="continuous",
            parent=chassis,
            child=motor,
            xyz=(x, inner, 0),
            rpy=turn,
            axis="0 0 1",
            limit=drive,
        ),
        fixed(hip, motor, upper, (0, 0.06, -0.015), (-TURN, 0, 0)),
        Joint(
            name=f"knee_{leg}_link",
            kind="revolute",
            parent=upper,
            child=lower,
            xyz=(0, 0.01, 0.055),
            axis="0 1 0",
            limit={"lower": 0.0, "upper": -1.0, **drive},
        ),
    ]


# ------------------------------------------------------------------------------------------------- humanoid


def _humanoid() -> bytes:
    links: list[Link] = [frame("base", 0.0001)]
    joints: list[Joint] = [fixed("root", "base", "root")]
    links += [
        _round("root", 6.0, 0.36, 0.28, "teal"),
        _round("chest", 14.0, 0.44, 0.48, "teal"),
        _round("neck", 2.0, 0.41, 0.7, "shell"),
    ]
    joints += [_free("chest", "root", (0, 0.9446, 0)), _free("neck", "chest", (0, 0.89558, 0))]
    for side, sign in (("right", 1), ("left", -1)):
        shoulder, elbow, wrist = f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist"
        links += [
            _limb(shoulder, 1.5, 0.18, 0.72, 0.56, "shell"),
            _limb(elbow, 1.0, 0.16, 0.54, 0.48, "shell"),
            _round(wrist, 0.5, 0.16, 0.0, "graphite"),
        ]
        joints += [
            _free(shoulder, "chest", (-0.0962, 0.974, 0.73244 * sign)),
            hinge(elbow, shoulder, elbow, (0, -1.09915, 0), "0 0 0", "0 0 1", 0, 3.14, 1000, 0.5),
            fixed(wrist, elbow, wrist, (0, -1.03579, 0)),
        ]
    for side, sign in (("right", 1), ("left", -1)):
        hip, knee, ankle = f"{side}_hip", f"{side}_knee", f"{side}_ankle"
        links += [
            _limb(hip, 4.5, 0.22, 1.2, 0.84, "shell"),
            _limb(knee, 3.0, 0.2, 1.24, 0.8, "shell"),
            solid(
                ankle,
                1.0,
                (0.18, -0.09, 0),
                (-0.174, -0.2, -0.18),
                (0.534, 0.02, 0.18),
                [slab((-0.174, -0.2, -0.18), (0.534, 0.02, 0.18), "graphite")],
            ),
        ]
        joints += [
            _free(hip, "root", (0, 0, 0.33955 * sign)),
            hinge(knee, hip, knee, (0, -1.68618, 0), "0 0 0", "0 0 1", -3.14, 0, 1000, 0.5),
            _free(ankle, knee, (0, -1.63948, 0)),
        ]
    ordered = _depth_first(links, joints)
    about = "Humanoid with ball joints, y up, four times life size as PyBullet's; its names and frames."
    return document("dumpUrdf", ordered, joints, pick("teal", "shell", "graphite"), about)


def _free(name: str, parent: str, xyz: tuple[float, float, float]) -> Joint:
    return Joint(name=name, kind="spherical", parent=parent, child=name, xyz=xyz)


def _round(name: str, mass: float, radius: float, height: float, color: str) -> Link:
    at, ball = (0, height, 0), sphere(radius)
    shape = Shape(geometry=ball, xyz=at)
    return Link(
        name=name,
        inertial=sphere_inertial(mass, radius, at),
        collisions=[shape],
        visuals=[Shape(geometry=ball, xyz=at, material=color)],
    )


def _limb(name: str, mass: float, radius: float, length: float, drop: float, color: str) -> Link:
    at, turn = (0, -drop, 0), (-HALF, 0, 0)
    geometry = f'<capsule radius="{radius:g}" length="{length:g}"/>'
    size = (2 * radius, length + 2 * radius, 2 * radius)
    return Link(
        name=name,
        inertial=box_inertial(mass, size, xyz=at),
        collisions=[Shape(geometry=geometry, xyz=at, rpy=turn)],
        visuals=[Shape(geometry=geometry, xyz=at, rpy=turn, material=color)],
    )


def _depth_first(links: list[Link], joints: list[Joint]) -> list[Link]:
    by_name = {link.name: link for link in links}
    found = [links[0]]
    for joint in joints:
        found.append(by_name[joint.child])
    return found

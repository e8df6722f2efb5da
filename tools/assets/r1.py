"""`r1/`: a dual-arm mobile manipulator on three steered wheels, packaged as vendors do.

Link and joint names and the collision spheres are those of the R1 source configuration beside the
URDF; dimensions follow from the spheres, everything else is our own. The package contains typical faults of
vendor files on purpose: see `README.md` in it.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

from assets import r1_arm as arm
from assets import r1_body as body
from assets.files import dae, mtl, obj, png, stl
from assets.mesh import Mesh, merge
from assets.palette import COLORS, pick
from assets.urdf import HEADER, Joint, Link, Numbers, Shape, box, document, mesh, mesh_inertial

ROOT = "r1/r1_description"
URI = "package://r1_description/meshes/"
HALF = pi / 2
DATA = Path(__file__).with_name("data")


def build() -> dict[str, bytes]:
    """Return every file of the package by its path under the assets folder."""
    files = {f"{ROOT}/meshes/{name}": data for name, data in _meshes().items()}
    links, joints = _robot()
    about = "R1, dual-arm mobile manipulator, as its maker ships it"
    colors = pick("shell", "graphite", "teal", "glow", "glass", "metal", "rubber", "red")
    files[f"{ROOT}/urdf/r1_pro_source.urdf"] = document("r1", links, joints, colors, about)
    files[f"{ROOT}/urdf/r1_source_config.yaml"] = (DATA / "r1_source_config.yaml").read_bytes()
    files[f"{ROOT}/package.xml"] = (DATA / "r1_package.xml").read_bytes()
    files[f"{ROOT}/README.md"] = (DATA / "r1_readme.md").read_bytes()
    return files


# ---------------------------------------------------------------------------------------------- meshes

OBJ: dict[str, Mesh] = {
    "base link shell (v2)": body.base_shell(),
    "base link trim": body.base_trim(),
    "base link accent": body.base_accent(),
    "base link lights": body.base_lights(),
    "servo (steering head)": body.servo(),
    "torso link1 (shell)": body.thigh_shell(),
    "torso link1 trim": body.thigh_trim(),
    "torso link1 accent": body.thigh_accent(),
    "torso link2 (shell)": body.shin_shell(),
    "torso link2 trim": body.shin_trim(),
    "torso link2 accent": body.shin_accent(),
    "chest (shell)": body.chest_shell(),
    "chest trim": body.chest_trim(),
    "chest accent": body.chest_accent(),
    "shoulder pod (left)": body.shoulder_pod(1),
    "shoulder pod (right)": body.shoulder_pod(-1),
    "head (shell)": body.head_shell(),
    "head visor": body.head_visor(),
    "head eyes": body.head_eyes(),
    "head ears": body.head_ears(),
    "arm link1 (shell)": arm.shoulder_shell(),
    "arm link1 accent": arm.shoulder_accent(),
    "arm link2 (shell)": arm.upper_shell(),
    "arm link2 trim": arm.upper_trim(),
    "arm link2 accent": arm.upper_accent(),
    "arm link3 (shell)": arm.fore_shell(),
    "arm link3 trim": arm.fore_trim(),
    "arm link3 accent": arm.fore_accent(),
    "arm link4 trim": arm.roll_shell(),
    "arm link5 (shell)": arm.wrist_shell(),
    "arm link5 accent": arm.wrist_accent(),
    "arm link6 camera": merge(arm.palm_trim(), arm.bolts()),
    "gripper finger": arm.finger(),
    "gripper finger pad": arm.finger_pad(),
}
STL: dict[str, tuple[Mesh, float]] = {
    "arm link6 palm (mm)": (arm.palm_shell(), 0.001),
    "stop button": (body.stop_button(), 1.0),
    "collision/base link (low poly)": (body.base_proxy(), 1.0),
    "collision/chest (low poly)": (body.chest_proxy(), 1.0),
    "collision/arm link6 (low poly)": (arm.palm_proxy(), 1.0),
    "collision/gripper finger (low poly)": (arm.finger_proxy(), 1.0),
}


def _meshes() -> dict[str, bytes]:
    out = {f"{name}.obj": obj(m, header=f"{HEADER}. R1: {name}.") for name, m in OBJ.items()}
    out |= {f"{name}.stl": stl(m, header=f"{HEADER}. R1: {name}.", unit=u) for name, (m, u) in STL.items()}
    out["wheel (with rim).obj"] = obj(body.wheel(), header=f"{HEADER}. R1: wheel.", mtl="r1_parts.mtl")
    out["chest badge.obj"] = obj(body.badge(), header=f"{HEADER}. R1: badge.", mtl="r1_parts.mtl")
    out["torso link3.dae"] = dae(
        body.waist().named("graphite"), header=f"{HEADER}. R1: waist.", colors=COLORS, unit=0.001
    )
    out["r1_parts.mtl"] = mtl(
        {"rubber": COLORS["rubber"], "metal": COLORS["metal"], "badge": (1, 1, 1)},
        header=HEADER,
        textures={"badge": "badge.png"},
    )
    out["badge.png"] = png(body.badge_pixels(), [(24, 28, 34), (235, 240, 244), (250, 170, 40)])
    return out


# ----------------------------------------------------------------------------------------------- links


def _obj(name: str, material: str | None = None, xyz: Numbers = "0 0 0", rpy: Numbers = "0 0 0") -> Shape:
    return Shape(geometry=mesh(f"{URI}{name}.obj"), material=material, xyz=xyz, rpy=rpy)


def _stl(name: str, material: str | None = None) -> Shape:
    unit = STL[name][1]
    scale = None if unit == 1.0 else (unit, unit, unit)
    return Shape(geometry=mesh(f"{URI}{name}.stl", scale), material=material)


def _robot() -> tuple[list[Link], list[Joint]]:
    links, joints = [_base()], []
    for number in (1, 2, 3):
        wheel_links, wheel_joints = _wheel(number)
        links += wheel_links
        joints += wheel_joints
    torso_links, torso_joints = _torso()
    links += torso_links
    joints += torso_joints
    for side, sign in (("left", 1), ("right", -1)):
        arm_links, arm_joints = _arm(side, sign)
        links += arm_links
        joints += arm_joints
    return links, joints


def _base() -> Link:
    return Link(
        name="base_link",
        inertial=mesh_inertial(42.0, body.base_shell(), body.base_trim()),
        visuals=[
            _obj("base link shell (v2)", "shell"),
            _obj("base link trim", "graphite"),
            _obj("base link accent", "teal"),
            _obj("base link lights", "glow"),
            _stl("stop button", "red"),
        ],
        collisions=[
            _stl("collision/base link (low poly)"),
            Shape(geometry=box(0.15, 0.18, 0.08), xyz=(-0.03, 0, 0.09)),
        ],
    )


def _wheel(number: int) -> tuple[list[Link], list[Joint]]:
    x, y = {1: (0.12, 0.165), 2: (0.12, -0.165), 3: (-0.185, 0.0)}[number]
    place = (x, y, body.SERVO_HEIGHT)
    flip = -1.0 if number == 2 else 1.0
    middle = (0.0, 0.0, -0.03 * flip)
    servo = Link(
        name=f"servo_link{number}",
        inertial=None if number == 2 else mesh_inertial(0.6, body.servo()),
        visuals=[_obj("servo (steering head)", "graphite")],
        collisions=[_obj("servo (steering head)")],
    )
    wheel = Link(
        name=f"wheel_link{number}",
        inertial=mesh_inertial(1.2, body.wheel().moved(middle)),
        visuals=[_obj("wheel (with rim)", xyz=middle)],
        collisions=[_obj("wheel (with rim)", xyz=middle)],
    )
    joints = [
        Joint(
            name=f"servo_joint{number}", kind="continuous", parent="base_link", child=servo.name, xyz=place,
            axis="0 0 1", limit={"effort": 20, "velocity": 12}, dynamics={"damping": 0.5, "friction": 0.1},
        ),
        Joint(
            name=f"wheel_joint{number}", kind="continuous", parent=servo.name, child=wheel.name,
            xyz=(0, 0.03, -body.WHEEL_DROP), rpy=(-HALF * flip, 0, 0), axis="0 0 1",
            limit={"effort": 25, "velocity": 30}, dynamics={"damping": 0.05, "friction": 0.02},
        ),
    ]  # fmt: skip
    return [servo, wheel], joints


def _painted(part: str) -> list[Shape]:
    """Return the shell, trim and accent of a part, if it has them, each in its colour."""
    files = ((f"{part} (shell)", "shell"), (f"{part} trim", "graphite"), (f"{part} accent", "teal"))
    return [_obj(name, color) for name, color in files if name in OBJ]


def _solid(part: str) -> list[Shape]:
    """Return the visual shell and trim of a part as its collision shapes."""
    return [_obj(name) for name in (f"{part} (shell)", f"{part} trim") if name in OBJ]


def _solids(part: str) -> list[Mesh]:
    return [OBJ[name] for name in (f"{part} (shell)", f"{part} trim") if name in OBJ]


def _torso() -> tuple[list[Link], list[Joint]]:
    pods = ("shoulder pod (left)", "shoulder pod (right)")
    columns = [
        Link(
            name=f"torso_link{number}",
            inertial=mesh_inertial(mass, *_solids(f"torso link{number}")),
            visuals=_painted(f"torso link{number}"),
            collisions=_solid(f"torso link{number}"),
        )
        for number, mass in ((1, 6.5), (2, 5.0))
    ]
    links = [
        *columns,
        Link(
            name="torso_link3",
            inertial=mesh_inertial(2.0, body.waist()),
            visuals=[Shape(geometry=mesh(f"{URI}torso link3.dae"), material="graphite")],
            collisions=[Shape(geometry=mesh(f"{URI}torso link3.dae"))],
        ),
        Link(
            name="torso_link4",
            inertial=mesh_inertial(13.0, *_solids("chest"), *_solids("head"), *(OBJ[pod] for pod in pods)),
            visuals=[
                *_painted("chest"),
                _obj("chest badge"),
                *(_obj(pod, "graphite") for pod in pods),
                *_painted("head"),
                _obj("head visor", "glass"),
                _obj("head eyes", "glow"),
                _obj("head ears", "teal"),
            ],
            collisions=[
                _stl("collision/chest (low poly)"),
                Shape(geometry=box(0.136, 0.168, 0.14), xyz=(0, 0, 0.445)),
                *(_obj(pod) for pod in pods),
            ],
        ),
    ]
    damping = {"damping": 4.0, "friction": 1.0}

    def joint(number: int, xyz: Numbers, rpy: Numbers, low: float, high: float, effort: float) -> Joint:
        parent = "base_link" if number == 1 else f"torso_link{number - 1}"
        limit = {"lower": low, "upper": high, "effort": effort, "velocity": 1.5}
        return Joint(
            name=f"torso_joint{number}", kind="revolute", parent=parent, child=f"torso_link{number}",
            xyz=xyz, rpy=rpy, axis="0 0 1", limit=limit, dynamics=damping,
        )  # fmt: skip

    joints = [
        joint(1, body.HIP, (-HALF, 0, 0), -0.9, 1.5, 450),
        joint(2, (0, -body.THIGH, 0), "0 0 0", -2.4, 2.4, 350),
        joint(3, (0, -body.SHIN, 0), "0 0 0", -1.6, 1.6, 250),
        joint(4, (0, -body.WAIST, body.SIDE), (HALF, 0, 0), -2.8, 2.8, 120),
    ]
    return links, joints


def _arm(side: str, sign: int) -> tuple[list[Link], list[Joint]]:
    def name(number: int) -> str:
        return f"{side}_arm_link{number}"

    links = [
        Link(
            name=name(number),
            inertial=mesh_inertial(mass, *_solids(f"arm link{number}")),
            visuals=_painted(f"arm link{number}"),
            collisions=_solid(f"arm link{number}"),
        )
        for number, mass in ((1, 1.6), (2, 2.4), (3, 1.5), (4, 0.5), (5, 0.5))
    ]
    links.append(
        Link(
            name=name(6),
            inertial=mesh_inertial(0.7, arm.palm_shell(), OBJ["arm link6 camera"]),
            visuals=[_stl("arm link6 palm (mm)", "graphite"), _obj("arm link6 camera", "metal")],
            collisions=[_stl("collision/arm link6 (low poly)")],
        )
    )
    for number in (1, 2):
        links.append(
            Link(
                name=f"{side}_gripper_link{number}",
                inertial=mesh_inertial(0.06, arm.finger(), arm.finger_pad()),
                visuals=[_obj("gripper finger", "metal"), _obj("gripper finger pad", "rubber")],
                collisions=[_stl("collision/gripper finger (low poly)")],
            )
        )
    x, y, z = body.SHOULDER
    joints: list[Joint] = []

    def turn(number: int, xyz: Numbers, rpy: Numbers, low: float, high: float, effort: float) -> None:
        slow = number < 4
        parent = "torso_link4" if number == 1 else name(number - 1)
        limit = {"lower": low, "upper": high, "effort": effort, "velocity": 3 if slow else 6}
        joints.append(
            Joint(
                name=f"{side}_arm_joint{number}", kind="revolute", parent=parent, child=name(number), xyz=xyz,
                rpy=rpy, axis="0 0 1", limit=limit,
                dynamics={"damping": 0.5 if slow else 0.1, "friction": 0.1 if slow else 0.02},
            )
        )  # fmt: skip

    turn(1, (x, sign * y, z), (sign * (body.SHOULDER_TILT - pi), 0, 0), -2.8, 2.8, 60)
    turn(2, (0, -arm.UPPER_PLANE, 0.085), (-HALF, 0, 0), -0.05, 3.1, 60)
    turn(3, arm.ELBOW, "0 0 0", -2.9, 0.02, 40)
    turn(4, arm.FOREARM, (0, HALF, 0), -1.65, 1.65, 20)
    turn(5, (0, arm.WRIST_PLANE, arm.WRIST), (HALF, -HALF, 0), -1.55, 1.55, 15)
    turn(6, (arm.HAND, 0, arm.WRIST_PLANE), (0, HALF, 0), -2.8, 2.8, 12)
    for number, way in ((1, -1), (2, 1)):
        joints.append(
            Joint(
                name=f"{side}_gripper_axis{number}", kind="prismatic", parent=name(6),
                child=f"{side}_gripper_link{number}", xyz=(0, way * 0.0115, 0.075),
                rpy=(-way * HALF, -HALF, 0), axis="0 0 1",
                limit={"lower": 0, "upper": 0.05, "effort": 0, "velocity": 0},
                mimic=f"{side}_gripper_axis1" if number == 2 else None,
            )
        )  # fmt: skip
    return links, joints

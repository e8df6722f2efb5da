"""Robots for the writers: one in memory with one of everything, and the bundled ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from roboyard.assets import asset_path
from roboyard.description import (
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Inertial,
    Joint,
    Limit,
    Link,
    Material,
    Mesh,
    Mimic,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
    load_description,
)
from roboyard.description.robot_model import (
    CollisionSphere,
    Metadata,
    PlanningData,
    RobotModel,
    Sensor,
)
from roboyard.description.semantic import REST, EndEffector, SemanticDescription
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import quaternion_from_rpy


def turned(position: tuple[float, float, float], *rpy: float) -> Pose:
    x, y, z, w = (float(v) for v in quaternion_from_rpy(rpy))
    return Pose(position=position, quaternion=(x, y, z, w))


def two_colored_box() -> TriangleMesh:
    """A box of 0.2 x 0.1 x 0.1 m, two of its twelve faces red, the rest blue."""
    box = primitives.box(0.1, 0.05, 0.05)
    colors = np.tile(np.array([0, 0, 255, 255], np.uint8), (12, 1))
    colors[:2] = (255, 0, 0, 255)
    return TriangleMesh(
        vertices=box.vertices,
        faces=box.faces,
        normals=box.normals,
        uv=box.uv,
        colors=read_only(colors, np.uint8),
    )


def inertial(mass: float, *tensor: float, origin: Pose | None = None) -> Inertial:
    ixx, ixy, ixz, iyy, iyz, izz = tensor
    return Inertial(mass=mass, origin=origin or Pose(), inertia=(ixx, ixy, ixz, iyy, iyz, izz))


def everything() -> RobotDescription:
    """Ten links: every joint type that a tree of bodies uses, awkward names and axes, shapes of all kinds."""
    box = Mesh(uri="", path=None, data=two_colored_box())
    plain = inertial(1.0, 0.01, 0, 0, 0.01, 0, 0.01)
    skew = inertial(
        2.0, 0.03, 0.004, -0.002, 0.04, 0.003, 0.05, origin=turned((0.1, 0.2, 0.3), 0.4, 0.5, 0.6)
    )
    red = Material(name="signal red", rgba=(0.8, 0.1, 0.1, 1.0))
    links = (
        Link(
            name="base",
            inertial=inertial(10.0, 0.3, 0, 0, 0.3, 0, 0.4),
            visuals=(Visual(geometry=Box(size=(0.4, 0.3, 0.2)), material=red),),
            collisions=(Collision(geometry=Box(size=(0.4, 0.3, 0.2))),),
            contact=Contact(lateral_friction=0.7, restitution=0.1),
        ),
        Link(
            name="arm.1",
            inertial=skew,
            visuals=(Visual(geometry=box, origin=turned((0.05, 0, 0.1), 0, 0.3, 0)),),
            collisions=(Collision(geometry=box, origin=turned((0.05, 0, 0.1), 0, 0.3, 0)),),
        ),
        Link(name="arm_1", inertial=plain, visuals=(Visual(geometry=Cylinder(radius=0.05, length=0.2)),)),
        Link(name="arm 1", inertial=plain, collisions=(Collision(geometry=Sphere(radius=0.06)),)),
        Link(name="10", inertial=plain, collisions=(Collision(geometry=Capsule(radius=0.03, length=0.1)),)),
        Link(name="tool"),
        Link(name="finger_a", inertial=plain, collisions=(Collision(geometry=Box(size=(0.02, 0.02, 0.05))),)),
        Link(name="finger_b", inertial=plain, collisions=(Collision(geometry=Box(size=(0.02, 0.02, 0.05))),)),
        Link(name="puck", inertial=plain, collisions=(Collision(geometry=box),)),
        Link(name="weightless"),
    )
    joints = (
        Joint(
            name="0",
            type="revolute",
            parent="base",
            child="arm.1",
            origin=turned((0.1, 0, 0.3), 0.1, 0.2, 0.3),
            axis=(0.0, 0.0, 1.0),
            limit=Limit(lower=-1.5, upper=2.0, effort=80.0, velocity=2.0),
            damping=0.5,
            friction=0.1,
        ),
        Joint(
            name="1",
            type="revolute",
            parent="arm.1",
            child="arm_1",
            origin=turned((0.3, 0, 0.1), 0, 0, 0.5),
            axis=(0.6, 0.0, 0.8),
            limit=Limit(lower=-0.5, upper=0.5, effort=40.0, velocity=3.0),
        ),
        Joint(
            name="slide",
            type="prismatic",
            parent="arm_1",
            child="arm 1",
            origin=turned((0, 0.1, 0), 0.7, 0, 0),
            axis=(0.0, -1.0, 0.0),
            limit=Limit(lower=0.0, upper=0.3, effort=100.0, velocity=0.5),
        ),
        Joint(name="spin", type="continuous", parent="arm 1", child="10", axis=(-1.0, 0.0, 0.0)),
        Joint(name="to_tool", type="fixed", parent="10", child="tool", origin=turned((0, 0, 0.2), 0, 1.2, 0)),
        Joint(
            name="grip",
            type="prismatic",
            parent="tool",
            child="finger_a",
            origin=turned((0, 0.03, 0.05), 0, 0, 0),
            axis=(0.0, 1.0, 0.0),
            limit=Limit(lower=0.0, upper=0.04, effort=20.0, velocity=0.2),
        ),
        Joint(
            name="grip_follower",
            type="prismatic",
            parent="tool",
            child="finger_b",
            origin=turned((0, -0.03, 0.05), 0, 0, 0),
            axis=(0.0, -1.0, 0.0),
            limit=Limit(lower=-0.1, upper=0.1, effort=20.0, velocity=0.2),
            mimic=Mimic(joint="grip", multiplier=1.5, offset=0.01),
        ),
        Joint(
            name="flat",
            type="planar",
            parent="base",
            child="puck",
            origin=turned((0, 0.5, 0), 0.2, 0, 0),
            axis=(0.0, 0.0, 1.0),
        ),
        Joint(
            name="ball",
            type="spherical",
            parent="puck",
            child="weightless",
            origin=turned((0, 0, 0.1), 0, 0, 0),
        ),
    )
    return RobotDescription(name="everything", links=links, joints=joints)


@pytest.fixture
def robot() -> RobotModel:
    """`everything` with sensors, drives and planning data."""
    planning = PlanningData(
        spheres={
            "base": (CollisionSphere(center=(0.0, 0.0, 0.1), radius=0.15),),
            "arm.1": (
                CollisionSphere(center=(0.1, 0.0, 0.0), radius=0.07),
                CollisionSphere(center=(0.2, 0.0, 0.0), radius=0.0612345678),
            ),
        },
        ignore={"base": ("arm.1",), "finger_a": ("finger_b",)},
        self_collision_buffer={"base": 0.02},
        lock_joints={"grip": 0.04, "grip_follower": 0.07},
    )
    semantic = SemanticDescription(
        base_link="base",
        end_effectors=(
            EndEffector(
                link="tool", gripper_links=("finger_a", "finger_b"), gripper_joints=("grip", "grip_follower")
            ),
        ),
        disabled_collision_pairs=(("base", "puck"), ("finger_a", "finger_b")),
        postures={
            REST: {"0": 0.25, "1": -0.1, "slide": 0.1, "spin": 0.0, "grip": 0.02, "grip_follower": 0.04}
        },
    )
    return RobotModel(
        name="everything",
        description=everything(),
        semantic=semantic,
        sensors=(
            Sensor(kind="visual_sphere", link="tool"),
            Sensor(kind="camera", link="tool", offset=turned((0.05, 0, -0.05), 0.1, 0.2, 0.3)),
            Sensor(kind="lidar", link="base", offset=turned((0, 0, 0.2), 0, 0, 0)),
        ),
        drives={"0": "position", "1": "effort", "slide": "position", "spin": "velocity", "grip": "position"},
        metadata=Metadata(bbox_size=(1.0, 2.0, 3.0), base_link_offset=(0.0, 0.1, 0.2)),
        planning=planning,
    )


@pytest.fixture(scope="session")
def bundled() -> Callable[[str], RobotModel]:
    """A bundled robot as it is, every joint with a range driven to positions."""

    def load(name: str) -> RobotModel:
        description = load_description(asset_path(name))
        drives = {j.name: "position" for j in description.joints if j.position_limits() and j.mimic is None}
        return RobotModel(
            name=name,
            description=description,
            semantic=SemanticDescription(base_link=description.root.name),
            drives=drives,  # type: ignore[arg-type]
        )

    return load

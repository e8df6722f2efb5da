"""Drives in the demo's world hold light joints still."""

import numpy as np
import pytest

from roboyard.demo.demo_world import DemoWorld
from roboyard.demo.plan import make_plan
from roboyard.description import RobotDescription, load_description
from roboyard.morphology.point_model import PointModel
from roboyard.sim import World


def hand() -> str:
    """A palm on the floor, four strong fingers of two light links; the outer follow the inner ones."""

    def link(name: str, mass: float, size: tuple[float, float, float], z: float) -> str:
        x, y, height = (mass * side**2 / 12 for side in size)
        shape = f'<origin xyz="0 0 {z}"/><geometry><box size="{size[0]} {size[1]} {size[2]}"/></geometry>'
        return (
            f'<link name="{name}"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>'
            f'<inertia ixx="{y + height}" iyy="{x + height}" izz="{x + y}" ixy="0" ixz="0" iyz="0"/>'
            f"</inertial><collision>{shape}</collision></link>"
        )

    def joint(name: str, parent: str, child: str, origin: str, more: str = "") -> str:
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin {origin}/><axis xyz="0 1 0"/>{more}'
            f'<limit lower="0" upper="1" effort="1000" velocity="3"/></joint>'
        )

    parts = [link("palm", 0.2, (0.09, 0.09, 0.04), 0.0)]
    for k in range(4):
        turn = k * np.pi / 2
        place = f'xyz="{0.05 * np.cos(turn)} {0.05 * np.sin(turn)} 0" rpy="0 0.5 {turn}"'
        parts += [
            link(f"inner{k}", 0.02, (0.012, 0.012, 0.04), 0.02),
            link(f"outer{k}", 0.008, (0.01, 0.01, 0.03), 0.015),
            joint(f"inner{k}_joint", "palm", f"inner{k}", place),
            joint(
                f"outer{k}_joint",
                f"inner{k}",
                f"outer{k}",
                'xyz="0 0 0.04"',
                f'<mimic joint="inner{k}_joint" multiplier="1.1"/>',
            ),
        ]
    return f'<robot name="hand">{"".join(parts)}</robot>'


def test_strong_light_fingers_with_followers_do_not_chatter() -> None:
    model = PointModel(load_description(hand()))
    scene = DemoWorld(model, make_plan(model))
    scene.world.step(720)
    fastest = 0.0
    for _ in range(60):
        scene.world.step()
        fastest = max(fastest, float(np.abs(scene.robot.joint_velocities).max()))
    assert fastest < 0.01


def test_the_demo_drives_joints_as_any_world_does(arm: RobotDescription) -> None:
    model = PointModel(arm)
    scene = DemoWorld(model, make_plan(model))
    world = World()
    alone = world.add_urdf(arm, scene.robot.position, fixed_base=True)
    alone.joint_positions = model.home
    for name, value in model.home.items():
        alone.joint(name).drive_position(value)
    scene.drive("shoulder", 0.6, 0.1)
    alone.joint("shoulder").drive_position(0.6, velocity=0.1)
    for _ in range(5):
        scene.world.step(48)
        world.step(48)
        assert scene.robot.joint_positions == pytest.approx(alone.joint_positions, abs=1e-9)
    assert alone.joint("shoulder").position == pytest.approx(0.6, abs=0.05)

"""How the robot stands on the demo's floor, held by its drives."""

from __future__ import annotations

import dataclasses

import numpy as np

from roboyard.demo.figure import Figure
from roboyard.demo.plan import make_plan
from roboyard.demo.stage import Stage
from roboyard.demo.stance import decide
from roboyard.urdf import RobotDescription, load_urdf


def _link(
    name: str, mass: float, size: tuple[float, float, float], height: float, shape: str, at: str
) -> str:
    """A link that weighs what a box of this size weighs, its centre at a height, with another shape."""
    x, y, z = (length**2 for length in size)
    moments = f'ixx="{mass * (y + z) / 12}" iyy="{mass * (x + z) / 12}" izz="{mass * (x + y) / 12}"'
    body = f'<origin xyz="{at}"/><geometry>{shape}</geometry>'
    return (
        f'<link name="{name}"><inertial><origin xyz="0 0 {height}"/><mass value="{mass}"/>'
        f'<inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial>'
        f"<visual>{body}</visual><collision>{body}</collision></link>"
    )


def _joint(name: str, parent: str, child: str, at: str, lower: float, upper: float) -> str:
    return (
        f'<joint name="{name}" type="revolute"><origin xyz="{at}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="0 1 0"/>'
        f'<limit lower="{lower}" upper="{upper}" effort="150" velocity="12"/></joint>'
    )


def heavy_quadruped() -> RobotDescription:
    """60 kg on four legs whose shanks weigh under a kilogram, on feet of one point."""
    parts = [_link("base", 60, (0.8, 0.3, 0.2), 0, '<box size="0.8 0.3 0.2"/>', "0 0 0")]
    for x, (lower, upper) in ((0.37, (-2.44, -0.35)), (-0.37, (0.35, 2.44))):
        for y in (0.2, -0.2):
            leg = f"{'f' if x > 0 else 'h'}{'l' if y > 0 else 'r'}"
            thigh, shank = f"{leg}_thigh", f"{leg}_shank"
            bar = '<box size="0.06 0.06 0.3"/>'
            parts.append(_link(thigh, 2.6, (0.06, 0.06, 0.35), -0.175, bar, "0 0 -0.175"))
            foot = '<sphere radius="0.02"/>'
            parts.append(_link(shank, 0.88, (0.04, 0.04, 0.33), -0.125, foot, "0 0 -0.33"))
            parts.append(_joint(f"{leg}_hip", "base", thigh, f"{x} {y} 0", -1.2, 0.9))
            parts.append(_joint(f"{leg}_knee", thigh, shank, "0 0 -0.35", lower, upper))
    return load_urdf(f'<robot name="heavy">{"".join(parts)}</robot>')


def test_a_heavy_robot_on_light_legs_comes_to_rest() -> None:
    figure = Figure(heavy_quadruped())
    plan = make_plan(figure)
    stage = Stage(figure, plan)
    assert plan.stance.kind == "held"
    assert not stage.robot.is_fixed
    stage.world.step(4 * 240)
    fastest = 0.0
    for _ in range(60):
        stage.world.step()
        linear, angular = stage.robot.velocity
        speeds = (stage.robot.joint_velocities, linear, angular)
        fastest = max(fastest, *(float(np.abs(speed).max()) for speed in speeds))
    assert fastest < 0.01  # rad/s and m/s; over 1 where the knees have no inertia of a motor's
    assert stage.robot.position[2] > 0.35


def test_a_robot_that_touches_nothing_is_mounted(walker: RobotDescription) -> None:
    ghost = dataclasses.replace(
        walker, links=tuple(dataclasses.replace(link, collisions=()) for link in walker.links)
    )
    assert decide(Figure(walker)).kind == "held"
    stance = decide(Figure(ghost))
    assert stance.kind == "mounted"
    assert "collision" in stance.reason

"""The files for Isaac Lab and Newton: run with a stand-in for Isaac Lab, and with Newton where it is."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import REST
from roboyard.export import python_configs, usd
from roboyard.export.usd.naming import paths_of
from roboyard.morphology.analyze import infer_semantics


def run(file: Path) -> dict[str, Any]:
    found: dict[str, Any] = {"__file__": str(file)}
    exec(compile(file.read_text(), str(file), "exec"), found)
    return found


def driving(robot: RobotModel) -> RobotModel:
    """The robot, understood, with motors on its wheels."""
    semantic = infer_semantics(robot.description)
    return replace(robot, semantic=semantic, drives={w.joint: "velocity" for w in semantic.driven_wheels})


@pytest.fixture
def isaac_lab(monkeypatch: pytest.MonkeyPatch) -> None:
    """Modules of Isaac Lab's names whose configurations keep what they are given."""
    keep = type("Keep", (SimpleNamespace,), {})
    articulation = type("ArticulationCfg", (SimpleNamespace,), {"InitialStateCfg": keep})
    modules = {
        "isaaclab": {},
        "isaaclab.sim": {
            "UsdFileCfg": keep,
            "RigidBodyPropertiesCfg": keep,
            "ArticulationRootPropertiesCfg": keep,
        },
        "isaaclab.actuators": {"ImplicitActuatorCfg": keep},
        "isaaclab.assets": {"ArticulationCfg": articulation},
    }
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    sys.modules["isaaclab"].sim = sys.modules["isaaclab.sim"]  # type: ignore[attr-defined]


def test_isaac_lab_gets_every_driven_joint_once(
    isaac_lab: None, bundled: Callable[[str], RobotModel], tmp_path: Path
) -> None:
    robot = driving(bundled("husky"))
    file = python_configs.write(robot, tmp_path).files[0]
    config = run(file)[f"{robot.name.upper()}_CFG"]
    assert Path(config.spawn.usd_path) == tmp_path / "usd" / f"{robot.name}.usda"
    assert config.spawn.articulation_props.fix_root_link is False
    names = [name for actuator in config.actuators.values() for name in actuator.joint_names_expr]
    joints = paths_of(robot).joints
    driven = {joints[name] for name, kind in robot.drives.items() if kind != "none"}
    assert sorted(names) == sorted(driven) and names
    for actuator in config.actuators.values():
        assert set(actuator.stiffness) == set(actuator.damping) == set(actuator.joint_names_expr)
        assert all(value > 0 for value in actuator.damping.values())


def test_the_rest_posture_has_the_names_of_the_stage(
    isaac_lab: None, robot: RobotModel, tmp_path: Path
) -> None:
    config = run(python_configs.write(robot, tmp_path).files[0])["EVERYTHING_CFG"]
    joints = paths_of(robot).joints
    assert set(config.init_state.joint_pos) <= set(joints.values())
    assert config.init_state.joint_pos[joints["0"]] == 0.25
    assert config.init_state.joint_pos[joints["grip"]] == 0.04  # as it is locked
    assert config.init_state.rot == (1.0, 0.0, 0.0, 0.0)


def test_newton_starts_the_robot_at_rest(bundled: Callable[[str], RobotModel], tmp_path: Path) -> None:
    newton = pytest.importorskip("newton", reason="Newton is not a dependency")
    pytest.importorskip("pxr")
    robot = driving(bundled("husky"))
    usd.write(robot, tmp_path / "usd" / f"{robot.name}.usda", textures=tmp_path / "textures")
    file = python_configs.write(robot, tmp_path).files[1]
    builder = newton.ModelBuilder()
    run(file)[f"add_{robot.name}"](builder)
    wanted = run(file)["DAMPING"]
    found = {}
    for joint, label in enumerate(builder.joint_label):
        if (name := label.rpartition("/")[2]) in wanted:
            found[name] = builder.joint_target_kd[builder.joint_qd_start[joint]]
    assert found == pytest.approx(wanted) and len(found) == 4
    builder.finalize(device="cpu")


def test_a_legged_robot_starts_on_its_bent_legs(
    isaac_lab: None, bundled: Callable[[str], RobotModel], tmp_path: Path
) -> None:
    """MuJoCo finds contacts with the floor 1 mm below the start position, and none 1 mm above it."""
    from roboyard.sim import World

    robot = bundled("walker")
    bent = {j.name: 0.5 * sum(limits) for j in robot.description.joints if (limits := j.position_limits())}
    assert any(abs(position) > 0.3 for position in bent.values())
    semantic = replace(infer_semantics(robot.description), postures={REST: bent})
    robot = replace(robot, semantic=semantic)
    config = run(python_configs.write(robot, tmp_path).files[0])[f"{robot.name.upper()}_CFG"]
    for above, touches in ((-1e-3, True), (1e-3, False)):
        world = World()
        floor = world.add_plane()
        body = world.add_description(robot.description, (0, 0, config.init_state.pos[2] + above))
        for joint in body.joints:
            if joint.is_scalar:
                joint.position = bent.get(joint.name, 0.0)
        world.detect_contacts()
        assert bool(world.contacts(body, floor)) is touches

"""A MoveIt 2 configuration, and the ros2_control tags and controllers that go with it.

| file | content |
| --- | --- |
| `<name>.srdf` | groups, end effectors, postures, the joint to the world, passive joints, pairs not checked |
| `kinematics.yaml` | a solver for each arm |
| `joint_limits.yaml` | velocity and acceleration of each joint |
| `moveit_controllers.yaml` | the controllers that MoveIt sends trajectories to |
| `ros2_controllers.yaml` | the same controllers for `ros2_control`, and the base's |
| `<name>.ros2_control.xacro` | `<ros2_control>`: interfaces, limits and rest positions of joints |

| concept | group |
| --- | --- |
| arm | chain from the link that carries it to its end effector |
| gripper of an arm | its driven joints; end effector of the arm |
| trunk, legs, head | their joints |
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from roboyard.export.export_result import ExportResult
from roboyard.export.names import identifier

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


def write(robot: RobotModel, folder: Path | str) -> ExportResult:
    """Write the configuration of a robot into a folder, which is `config/` of a MoveIt package.

    Args:
        robot: its semantics name the groups; without arms, legs and trunk there are none, with a note.
        folder: where the files are written.
    """
    from roboyard.export.moveit.control import control_text, ros2_controllers
    from roboyard.export.moveit.groups import groups_of
    from roboyard.export.moveit.settings import joint_limits, kinematics, moveit_controllers
    from roboyard.export.moveit.srdf import srdf_text

    place, name = Path(folder), identifier(robot.name, "robot")
    groups = groups_of(robot)
    texts = {
        f"{name}.srdf": srdf_text(robot, groups),
        "kinematics.yaml": kinematics(groups),
        "joint_limits.yaml": joint_limits(robot),
        "moveit_controllers.yaml": moveit_controllers(groups),
        "ros2_controllers.yaml": ros2_controllers(robot, groups),
        f"{name}.ros2_control.xacro": control_text(robot),
    }
    place.mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        (place / file).write_text(text, encoding="utf-8")
    notes = () if groups else ("no arm, leg or trunk; the SRDF has no groups",)
    return ExportResult(files=tuple(place / file for file in texts), notes=notes)

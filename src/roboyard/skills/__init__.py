"""Skills of a robot, by name: drive to a room, grasp a mug, open a drawer.

skills = Skills(robot, scene)
skills.open("kitchen_east/drawer_2")
result = skills.grasp("mug")
if not result: print(result)            grasp mug: no gripper pose is within reach; ...
"""

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names

_HOMES = {
    "SkillResult": "roboyard.skills.outcome",
    "Skills": "roboyard.skills.skill_set",
}

__all__ = ["SkillResult", "Skills"]

if TYPE_CHECKING:
    from roboyard.skills.outcome import SkillResult
    from roboyard.skills.skill_set import Skills

__getattr__ = lazy_names(__name__, _HOMES)

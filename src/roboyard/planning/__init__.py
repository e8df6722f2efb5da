"""Motion planning for any robot on one CPU core: collision checks, paths, timing."""

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names

_HOMES = {
    "CollisionChecker": "roboyard.planning.checking",
    "DistanceField": "roboyard.planning.distance_fields",
    "Obstacle": "roboyard.planning.obstacles",
    "Obstacles": "roboyard.planning.obstacles",
    "SphereModel": "roboyard.planning.sphere_model",
    "sphere_robot": "roboyard.planning.sphere_model",
}

__all__ = [
    "CollisionChecker",
    "DistanceField",
    "Obstacle",
    "Obstacles",
    "SphereModel",
    "sphere_robot",
]

if TYPE_CHECKING:
    from roboyard.planning.checking import CollisionChecker
    from roboyard.planning.distance_fields import DistanceField
    from roboyard.planning.obstacles import Obstacle, Obstacles
    from roboyard.planning.sphere_model import SphereModel, sphere_robot

__getattr__ = lazy_names(__name__, _HOMES)

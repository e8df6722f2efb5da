"""A small arm with spheres on its links."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.description.robot_model import CollisionSphere
from roboyard.planning import SphereModel


@pytest.fixture(scope="session")
def arm() -> SphereModel:
    """The bundled arm with three spheres on each link, along the line to the next link."""
    description = load_description(assets_root() / "arm7" / "arm7.urdf")
    spheres = {}
    for link in description.links:
        joints = description.child_joints[link.name]
        end = np.array(joints[0].origin.position if joints else (0, 0, 0.05))
        spheres[link.name] = tuple(
            CollisionSphere(center=tuple(float(x) for x in end * share), radius=0.06 - 0.01 * share)
            for share in (0.0, 0.5, 1.0)
        )
    ignore = set()
    order = [link.name for link in description.links]
    for i, a in enumerate(order):
        ignore |= {(min(a, b), max(a, b)) for b in order[i + 1 : i + 4]}
    return SphereModel(
        description=description,
        spheres=spheres,
        ignore=frozenset(ignore),
        self_buffer={},
        retract={},
        locked={},
        buffer=0.002,
    )

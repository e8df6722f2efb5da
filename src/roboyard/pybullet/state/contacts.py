"""The contacts of the last step, with the links of each pair in Bullet's order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.bullet_rules.contact_order import kind_of, tangents

if TYPE_CHECKING:
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Point = tuple[Any, ...]
Place = tuple[int, int]
"""Body and link; link -1 is the base."""
ANY_LINK = -2


def touching(scene: PhysicsScene) -> Iterable[tuple[tuple[Place, Place], Point]]:
    """Return each contact's links in Bullet's order and getContactPoints fields from point on A."""
    if scene.world.is_stale or scene.world.live_data.ncon == 0:
        return ()
    return _touching(scene)


def _touching(scene: PhysicsScene) -> Iterator[tuple[tuple[Place, Place], Point]]:
    from roboyard.sim.queries.contacts import contact_arrays

    arrays = contact_arrays(scene.world)
    middles = arrays.position.tolist()
    normals = arrays.frame[:, 0].tolist()
    if scene.parts > 1:
        arrays.force[:] /= scene.parts
    forces = np.einsum("ij,ijk->ik", arrays.force, arrays.frame).tolist()
    kinds: dict[Place, int] = {}
    geoms = scene.world.live_data.contact.geom.tolist()
    reaches: Any = None
    for i, distance in enumerate(arrays.distance.tolist()):
        pushing = float(arrays.force[i, 0])
        if distance > 0.0 and pushing <= 0.0:
            if reaches is None:
                reaches = scene.contact_reaches()
            a, b = geoms[i]
            if a < 0 or b < 0 or distance > min(reaches[a], reaches[b]):
                continue
        world_a, link_a, world_b, link_b = arrays.owners[i].tolist()
        a, b = (scene.record_of(world_a).number, link_a - 1), (scene.record_of(world_b).number, link_b - 1)
        is_turned = _comes_second(scene, a, b, kinds)
        point = _point(middles[i], normals[i], distance, pushing, forces[i], is_turned=is_turned)
        yield ((b, a) if is_turned else (a, b)), point


def _comes_second(scene: PhysicsScene, a: Place, b: Place, kinds: dict[Place, int]) -> bool:
    """Return whether Bullet lists b first."""
    for body, link in (a, b):
        if (body, link) not in kinds:
            kinds[(body, link)] = kind_of(scene.bodies[body].model.links[link + 1])
    if kinds[a] != kinds[b]:
        return kinds[a] < kinds[b]
    age = scene.bodies[a[0]].body.id - scene.bodies[b[0]].body.id
    return age > 0 or (age == 0 and a[1] > b[1])


def _point(
    middle: list[float],
    normal: list[float],
    distance: float,
    pushing: float,
    force: list[float],
    *,
    is_turned: bool,
) -> tuple[Any, ...]:
    """Return point on A, point on B (m), normal on B, distance (m), and the forces on A (N).

    Middle, normal and force are MuJoCo's: the normal points to its second geom, on which the force acts.
    """
    half, sign = 0.5 * distance, 1.0 if is_turned else -1.0
    on_b = (sign * normal[0], sign * normal[1], sign * normal[2])
    first, second = tangents(on_b)
    on_a = tuple(m + half * n for m, n in zip(middle, on_b, strict=True))
    across = (sum(f * t for f, t in zip(force, way, strict=True)) * sign for way in (first, second))
    first_force, second_force = across
    return (
        on_a, tuple(m - half * n for m, n in zip(middle, on_b, strict=True)), on_b, distance, pushing,
        first_force, first, second_force, second,
    )  # fmt: skip

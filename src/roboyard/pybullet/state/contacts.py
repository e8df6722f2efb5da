"""The contacts of the last step, with the links of each pair in Bullet's order; kept through later edits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.bullet_rules.contact_order import kind_of, tangents

if TYPE_CHECKING:
    from roboyard.sim.queries.contacts import ContactArrays

Point = tuple[Any, ...]
Place = tuple[int, int]
"""Body and link; link -1 is the base."""
Contact = tuple[tuple[Place, Place], Point]
"""Links in Bullet's order, and getContactPoints fields from point on A."""
ANY_LINK = -2


def touching(scene: Any) -> Iterable[Contact]:
    """Return each contact's links in Bullet's order and getContactPoints fields from point on A."""
    last = scene.last_step
    if last.contacts is not None:
        found: Iterable[Contact] = last.contacts
    elif scene.world.is_stale or scene.world.live_data.ncon == 0:
        return ()
    else:
        found = _touching(scene)
    if last.filtered:
        return [row for row in found if last.filtered.keys().isdisjoint(row[0])]
    return found


def _touching(scene: Any) -> list[Contact]:
    """Return the contacts in MuJoCo's arrays; scripts ask once for each foot, so they are kept meanwhile."""
    from roboyard.sim.queries.contacts import contact_arrays

    arrays = contact_arrays(scene.world)
    if scene.parts > 1:
        arrays.force[:] /= scene.parts
    geoms = scene.world.live_data.contact.geom
    last, asked = scene.last_step, (arrays.position, arrays.frame, arrays.distance, arrays.force, geoms)
    key = (scene.world.revision, *[array.tobytes() for array in asked])
    if last.listed is None or last.listed[0] != key:
        last.listed = key, list(_contacts_in(scene, arrays, geoms.tolist()))
    return last.listed[1]


def _contacts_in(scene: Any, arrays: ContactArrays, geoms: list[list[int]]) -> Iterator[Contact]:
    middles = arrays.position.tolist()
    normals = arrays.frame[:, 0].tolist()
    forces = np.einsum("ij,ijk->ik", arrays.force, arrays.frame).tolist()
    kinds: dict[Place, int] = {}
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


def _comes_second(scene: Any, a: Place, b: Place, kinds: dict[Place, int]) -> bool:
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


class LastStep:
    """The contacts, motor efforts and reactions of the last step, from the first later edit on."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self.contacts: list[Contact] | None = None
        """Kept contacts; None where MuJoCo's arrays have them."""
        self.listed: tuple[tuple[Any, ...], list[Contact]] | None = None
        """The contents of MuJoCo's arrays when they were last read, and the contacts in them."""
        self.filtered: dict[Place, None] = {}
        """Links whose contacts are forgotten: a new filter lets Bullet find their pairs again in the next
        step."""

    def keep(self) -> None:
        """Keep what MuJoCo's arrays hold of the last step, before these are replaced."""
        scene = self._scene
        world = scene.world
        if world.is_stale or world.body_by_id.keys() != scene.world_ids():
            return  # kept before the first of several edits
        if scene.motor_revision == world.revision:
            self._keep_efforts(scene)
        if self.contacts is None:
            self.contacts = self._present()

    def _present(self) -> list[Contact]:
        return list(touching(self._scene))

    def _keep_efforts(self, scene: Any) -> None:
        for number, record in scene.bodies.items():
            if not record.joint_count:
                continue
            scene.ready(number, "")
            for joint in record.sensors:
                from roboyard.pybullet.state.reactions import reaction

                record.reactions[joint] = reaction(scene, record, joint)
            applied: list[Any] = [scene.applied(record, joint) for joint in range(record.joint_count)]
            record.applied[:] = applied
        scene.motor_revision = -1

    def drop(self) -> None:
        """Forget kept contacts: MuJoCo's arrays have newer ones."""
        self.contacts = None
        self.filtered.clear()

    def restore(self, saved: Sequence[Contact]) -> None:
        """Take the contacts of a saved state; without any, Bullet leaves the present ones."""
        if not saved:
            self.contacts = self._present()
            return
        self.filtered.clear()
        bodies = self._scene.bodies
        self.contacts = [row for row in saved if row[0][0][0] in bodies and row[0][1][0] in bodies]

    def remove_body(self, number: int) -> None:
        """Forget the contacts of a body."""
        if self.contacts:
            self.contacts = [row for row in self.contacts if number not in (row[0][0][0], row[0][1][0])]

"""Reading link states from MuJoCo's arrays, one link or several with one compiled call, and pushing links."""

from __future__ import annotations

from functools import partial
from struct import Struct
from typing import TYPE_CHECKING, Any

import numpy as np

import roboyard.pybullet.state.state_kernels as kernels
from roboyard._lazy import lazy_module
from roboyard.pybullet.state.frames import SINGLE_READS
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from roboyard.pybullet.face.arguments import Vector3
    from roboyard.pybullet.state.bodies.body_records import (
        BodyRecord,
        LinkPusher,
        LinkReader,
        MovedLinkReader,
    )
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.sim.pool.lone_bodies import LoneBody
    from roboyard.sim.world import World
    from roboyard.transforms import Array

chain_kernels = lazy_module("roboyard.pybullet.bullet_rules.chain_kernels")
State = tuple[Any, ...]
_CACHE_SIZE = 64
_CHAIN = "chain"
"""Name in `Engine.of_arrays`."""
_positions_of, _orientations_of = Struct("3d").iter_unpack, Struct("4d").iter_unpack


def link_reader(world: World | LoneBody, record: BodyRecord) -> LinkReader:
    """Return `read(link, with_velocity, is_fresh)` of links; valid until MuJoCo's model is recompiled.

    It shows the frames of the arrays; unless `is_fresh`, those of the last step where these were kept.
    """
    rows = record.rows
    data, rootid = world.live_data, world.live_model.body_rootid
    xpos, xquat, cvel, xipos, subtree_com = data.xpos, data.xquat, data.cvel, data.xipos, data.subtree_com
    frames = inertial_frames(record)
    found = np.zeros(20)
    local = [(link.frame.position, link.frame.quaternion) for link in record.links]

    def read(link: int, with_velocity: object, is_fresh: bool) -> State:
        place = link + 1
        centre, turn = local[place]
        if not with_velocity:
            positions, turns = (None if is_fresh else world.kept_frames) or (xpos, xquat)
            kernels.write_link_pose(positions, turns, frames, rows[place], place, found)
            v = tuple(found.tolist())
            return v[:3], v[3:7], centre, turn, v[7:10], v[10:14]
        world.link_velocities()
        positions, turns = (None if is_fresh else world.kept_frames) or (xpos, xquat)
        kernels.write_link_state(
            *(positions, turns, frames, rows[place], place, xquat, cvel, xipos, subtree_com, rootid, found)
        )
        v = tuple(found.tolist())
        return v[:3], v[3:7], centre, turn, v[7:10], v[10:14], v[14:17], v[17:]

    record.link_reader = read
    return read


def moved_link_reader(world: World, record: BodyRecord) -> MovedLinkReader:
    """Return `read(link, with_velocity, is_fresh)` of a body's links in the present state of the World.

    It leaves all frames as they are; with velocity those of the last step are shown unless `is_fresh`.
    """
    data, rows, chain = world.live_data, record.rows, chain_of(world)
    xpos, xquat = data.xpos, data.xquat
    frames, found, moving = inertial_frames(record), np.zeros(14), np.zeros(20)
    local = [(link.frame.position, link.frame.quaternion) for link in record.links]
    loops = chain_kernels()
    write, write_state = loops.write_pose_of_chain, loops.write_state_of_chain

    def read(link: int, with_velocity: object, is_fresh: bool) -> State:
        place = link + 1
        centre, turn = local[place]
        if with_velocity:
            shown, turns = world.kept_frames or (xpos, xquat)
            write_state(chain, shown, turns, frames, rows[place], place, 1 if is_fresh else 0, moving)
            v = tuple(moving.tolist())
            return v[:3], v[3:7], centre, turn, v[7:10], v[10:14], v[14:17], v[17:]
        write(chain, frames, rows[place], place, found)
        v = tuple(found.tolist())
        return v[:3], v[3:7], centre, turn, v[7:10], v[10:14]

    record.moved_link_reader = read
    return read


def chain_of(world: World) -> Any:
    """Return MuJoCo's arrays as the argument of `chain_kernels`, once for all bodies."""
    loops = chain_kernels()
    known = world.of_arrays
    if _CHAIN not in known:
        model, data = world.live_model, world.live_data
        known[_CHAIN] = loops.CHAIN.of(
            loops.Chain(
                *(model.body_parentid, model.body_jntnum, model.body_jntadr, model.jnt_type),
                *(model.jnt_qposadr, model.jnt_axis, model.jnt_pos, model.body_pos, model.body_quat),
                *(model.qpos0, data.qpos, np.zeros(model.nbody, np.int64), np.zeros((1, 3))),
                *(np.zeros((1, 4)), model.jnt_dofadr, data.qvel, model.body_ipos, np.zeros((2, 3))),
            )
        )
    return known[_CHAIN]


def link_pusher(scene: PhysicsScene, record: BodyRecord) -> LinkPusher:
    """Return `push(link, local, (fx, ..., pz))` of a body; valid until MuJoCo's model is recompiled."""
    world, rows = scene.world, record.rows
    data, wrenches = world.live_data, world.wrenches
    xpos, xquat, xipos, qpos, applied = data.xpos, data.xquat, data.xipos, data.qpos, data.xfrc_applied
    frames, free = inertial_frames(record), record.body.free_qpos
    centres = world.live_model.body_ipos
    arrays = kernels.Pushed(xpos, xquat, xipos, qpos, frames, applied, centres)

    def push(link: int, local: int, numbers: tuple[Any, ...]) -> bool:
        place = free if link < 0 else -1
        is_fresh = place < 0 and scene.is_shown(record)
        if place < 0 and (is_fresh or scene.frames_revision != world.revision):
            scene.frames(fresh=True)
        shown, turns = (None if is_fresh else world.kept_frames) or (xpos, xquat)
        link += 1
        row, moved = rows[link], 4 if place < 0 and world.is_moved else 0
        done = kernels.push_link(arrays, shown, turns, row, link, place, local + moved, *numbers)
        if done < 0:
            world.link_frames(keeps_last=True)
            shown, turns = world.kept_frames or (xpos, xquat)
            done = kernels.push_link(arrays, shown, turns, row, link, place, local, *numbers)
        if done:
            wrenches.pending = wrenches.pushed = True
            return True
        return False

    record.link_pusher = push
    if "push" in world.prepared:
        world.prepared["push"][record.number] = (
            *(scene, world, wrenches, xpos, xquat, xipos, qpos, frames, applied),
            *(np.array(rows, dtype=np.int64), free, centres, scene.step_count, record.shown),
        )
    return push


class LinkBoxes:
    """Boxes around the shapes of one body's links; valid until MuJoCo's model is recompiled."""

    __slots__ = (
        *("_box", "_boxes", "_chain", "_frames", "_rows", "_scene", "_shown", "_world", "_xpos", "_xquat"),
    )

    def __init__(self, scene: PhysicsScene, record: BodyRecord) -> None:
        """Prepare reading of the boxes of a body."""
        world = scene.world
        data, count = world.live_data, len(record.rows)
        self._scene, self._world, self._xpos, self._xquat = scene, world, data.xpos, data.xquat
        self._chain, self._shown = chain_of(world), record.shown
        self._frames, self._rows = inertial_frames(record), np.array(record.rows, dtype=np.int64)
        self._box, self._boxes = np.zeros(6), np.zeros((count, 8))
        for place, link in enumerate(record.model.links):
            bounds, margin = record.shapes.bounds(place - 1)
            kind = {"sphere": 1.0, "plane": 2.0}.get(bounds.kind, 0.0)
            self._boxes[place] = *bounds.grown(margin).reshape(-1), kind, bool(link.collisions)
        if "box" in world.prepared and record.soft is None:
            world.prepared["box"][record.number] = (
                *(world, data.xpos, data.xquat, self._frames, self._boxes, self._rows, self._box),
                *(scene, chain_kernels().write_box_of_chain, self._chain),
                *(tuple(n for place, row in enumerate(record.rows) for n in (row, place)), count - 1),
                *(scene.step_count, record.shown),
            )

    @property
    def arrays(self) -> tuple[Array, Array, np.ndarray]:
        """(n, 7) inertial frames in link frames, (n, 8) boxes in these, and (n,) MuJoCo's rows of links."""
        return self._frames, self._boxes, self._rows

    def read(self, link: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the two (3,) corners of a link's box in the world (m); -1 for the base.

        As in Bullet, those of links but the base are where they were before the last step, until a script
        places the body or has its frames computed.
        """
        place, box, scene = link + 1, self._box, self._scene
        poses = self._last_poses() if link >= 0 else None
        if poses is not None:
            kernels.link_box(*poses, self._frames, self._boxes, int(self._rows[place]), place, box)
        elif self._world.is_moved and scene.single_reads < SINGLE_READS:
            scene.single_reads += 1
            write_box = chain_kernels().write_box_of_chain
            write_box(self._chain, self._frames, self._boxes, int(self._rows[place]), place, box)
        else:
            scene.single_reads = 0
            self._world.link_frames(keeps_last=True)
            kernels.link_box(
                self._xpos, self._xquat, self._frames, self._boxes, int(self._rows[place]), place, box
            )
        a, b, c, d, e, f = box.tolist()
        return (a, b, c), (d, e, f)

    def _last_poses(self) -> tuple[Array, Array] | None:
        """Return (nbody, 3) places (m) and (nbody, 4) quaternions before the last step, if these count."""
        scene, world = self._scene, self._world
        if scene.frames_are_old or scene.frames_revision != world.revision:
            return None
        if self._shown[0] == scene.step_count[0]:
            return None
        return world.kept_frames or (self._xpos, self._xquat)


class SceneBoxes:
    """Boxes around the shapes of all links of a scene; valid until MuJoCo's arrays or the boxes change."""

    __slots__ = ("_answers", "_arrays", "_found", "_kept", "_owners", "_scene", "_tables", "_words")

    def __init__(
        self,
        scene: PhysicsScene,
        records: Sequence[BodyRecord],
        arrays: Sequence[tuple[Array, Array, np.ndarray]],
    ) -> None:
        """Put the boxes of bodies together; the links of the last body come first in answers.

        Args:
            scene: of the bodies.
            records: bodies.
            arrays: `LinkBoxes.arrays` of each body.
        """
        self._scene, world = scene, scene.world
        data = world.live_data
        frames, boxes, rows = map(np.concatenate, zip(*arrays, strict=True))
        reaches = kernels.reaches_of(frames, boxes)
        first, place = np.full((len(rows), 6), np.nan), 0
        for record in records:
            if record.number in scene.new_bodies:
                first[place : place + len(record.rows)] = _boxes_as_added(record, world.live_model)
            place += len(record.rows)
        self._tables = frames, boxes, rows, reaches, first
        self._arrays = kernels.BOXES.of(kernels.Boxes(data.xpos, data.xquat, *self._tables))
        self._kept: tuple[Any, Any] = (None, None)
        """Poses that were kept, and the same with these."""
        self._owners = [(record.number, link - 1) for record in records for link in range(len(record.rows))]
        self._found = np.zeros(6), np.zeros(len(self._owners), np.int64)
        self._words = self._found[1].data.cast("B")
        self._answers: dict[bytes, tuple[tuple[int, int], ...]] = {}  # by the places that were found
        if "overlaps" in world.prepared:
            world.prepared["overlaps"][0] = (
                *(world, partial(world.link_frames, keeps_last=True), data.xpos, data.xquat, frames, boxes),
                *(rows, reaches, first, *self._found, tuple(self._owners), scene),
            )

    def inside(self, low: Vector3, high: Vector3, margin: float) -> tuple[tuple[int, int], ...]:
        """Return body and link of those with shapes whose boxes overlap one with (3,) corners (m).

        Boxes of links are larger by the margin (m) on all sides. As in Bullet, links are where they were
        before the last step, until a command needs their present places, and bodies that were not placed
        since they were added have boxes of their own.
        """
        box, found = self._found
        count = kernels.links_in_box(self._posed(), *low, *high, margin, box, found)
        key = self._words[: 8 * count].tobytes()
        answer = self._answers.get(key)
        if answer is None:
            if len(self._answers) > _CACHE_SIZE:
                self._answers.clear()
            answer = self._answers[key] = tuple(map(self._owners.__getitem__, found[:count].tolist()))
        return answer

    def _posed(self) -> Any:
        """Return all arrays, with the poses that count."""
        scene, world = self._scene, self._scene.world
        if scene.frames_revision != world.revision:
            scene.frames_are_old = True  # which machine code looks at
        if scene.frames_are_old or scene.boxes_are_old:
            world.link_frames(keeps_last=True)
            return self._arrays
        kept = None if world.is_moved else world.kept_frames
        if kept is None:
            return self._arrays
        if self._kept[0] is not kept:
            self._kept = kept, kernels.BOXES.of(kernels.Boxes(*kept, *self._tables))
        return self._kept[1]


def _boxes_as_added(record: BodyRecord, model: Any) -> Array:
    """Return the (n, 6) least and largest coordinates (m) of links where Bullet added them to the world.

    Not numbers where these are not known, and for links without shapes.
    """
    if record.first_pose is None:
        return np.full((len(record.rows), 6), np.nan)
    covers, pose = record.shapes.first_boxes(model), np.array(record.first_pose)
    turn = matrix_from_quaternion(pose[3:])
    half = np.abs(covers[:, 1:4] @ turn.T).sum(axis=1) + covers[:, 4]
    middle = covers[:, 0] @ turn.T + pose[:3]
    found = np.concatenate([middle - half, middle + half], axis=1)
    found[[not link.collisions for link in record.model.links]] = np.nan
    return found


class LinkGroup:
    """Some links of one body; valid until MuJoCo's model is recompiled."""

    __slots__ = ("_arrays", "_centres", "_frames", "_moving", "_parts", "_speeds", "_turns", "_world")

    def __init__(self, world: World | LoneBody, record: BodyRecord, links: list[int]) -> None:
        """Prepare reading of `links` of a body."""
        data = world.live_data
        places = np.array([link + 1 for link in links], dtype=np.int64)
        rows = np.array([record.rows[place] for place in places], dtype=np.int64)
        positions, turned = np.zeros((2, len(links), 3)), np.zeros((2, len(links), 4))
        self._world, self._frames = world, (data.xpos, data.xquat)
        self._arrays = inertial_frames(record), rows, places, positions, turned
        velocities = np.zeros((2, len(links), 3))
        self._moving = data.xquat, data.cvel, data.xipos, data.subtree_com, world.live_model.body_rootid
        self._speeds = velocities, velocities[0].data, velocities[1].data
        self._parts = positions[0].data, turned[0].data, positions[1].data, turned[1].data
        self._centres = tuple(record.links[place].frame.position for place in places)
        self._turns = tuple(record.links[place].frame.quaternion for place in places)

    def read(self, with_velocity: object, is_fresh: bool) -> tuple[State, ...]:
        """Return the fields of getLinkState of each link; see `link_reader` for the arguments."""
        speeds: tuple[Any, ...] = ()
        if with_velocity:
            self._world.link_velocities()
        shown = (None if is_fresh else self._world.kept_frames) or self._frames
        if with_velocity:
            frames, rows, places, positions, turned = self._arrays
            velocities, linear, angular = self._speeds
            kernels.link_states(*shown, frames, rows, places, *self._moving, positions, turned, velocities)
            speeds = _positions_of(linear), _positions_of(angular)
        else:
            kernels.link_poses(*shown, *self._arrays)
        positions, turned, frame_positions, frame_turned = self._parts
        return tuple(
            zip(
                _positions_of(positions), _orientations_of(turned), self._centres, self._turns,
                _positions_of(frame_positions), _orientations_of(frame_turned), *speeds, strict=True,
            )
        )  # fmt: skip


def link_group(world: World | LoneBody, record: BodyRecord, links: list[int]) -> LinkGroup:
    """Return the group of these links, cached with the body."""
    if len(record.link_groups) > _CACHE_SIZE:
        record.link_groups.clear()
    found = record.link_groups[tuple(links)] = LinkGroup(world, record, links)
    return found


def inertial_frames(record: BodyRecord) -> np.ndarray:
    """Return (n, 7) position (m) and quaternion of each link's inertial frame in its link frame."""
    return np.array([(*link.frame.position, *link.frame.quaternion) for link in record.links])


class AwaitingBoxes:
    """Boxes around the shapes of one body's links while a compile is awaited."""

    __slots__ = ("_boxes", "_found", "_frames", "_rows", "_update")

    def __init__(self, record: BodyRecord, update: Callable[[], Any]) -> None:
        """Prepare reading of the boxes of a body; `update` returns the MjData with its present frames."""
        self._frames, self._rows = inertial_frames(record), np.array(record.rows, dtype=np.int64)
        self._update, self._found = update, np.zeros(6)
        self._boxes = np.zeros((len(record.rows), 8))
        for place, link in enumerate(record.model.links):
            bounds, margin = record.shapes.bounds(place - 1)
            kind = {"sphere": 1.0, "plane": 2.0}.get(bounds.kind, 0.0)
            self._boxes[place] = *bounds.grown(margin).reshape(-1), kind, bool(link.collisions)

    @property
    def arrays(self) -> tuple[Array, Array, np.ndarray]:
        """(n, 7) inertial frames in link frames, (n, 8) boxes in these, and (n,) MuJoCo's rows of links."""
        return self._frames, self._boxes, self._rows

    def read(self, link: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the two (3,) corners of a link's box in the world (m); -1 for the base."""
        data, place, box = self._update(), link + 1, self._found
        row = int(self._rows[place])
        kernels.link_box(data.xpos, data.xquat, self._frames, self._boxes, row, place, box)
        a, b, c, d, e, f = box.tolist()
        return (a, b, c), (d, e, f)

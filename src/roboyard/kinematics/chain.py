"""Compile a robot's tree of joints into plain arrays for the kernels.

Only moving joints become nodes: fixed and locked joints are folded into constant transforms. Every node frame
is rotated so that its z axis is the joint's axis; a joint's motion then rotates two columns or translates
along one. A link is a node plus a constant offset; node -1 is the base link.

Joints with several degrees of freedom are a row of one-degree nodes:

    spherical  NAME:rx, NAME:ry, NAME:rz         rotations about x, then the new y, then the new z
    planar     NAME:x, NAME:y, NAME:rz           translations along `plane_axes`, then a rotation about the
    normal floating   NAME:x, :y, :z, :rx, :ry, :rz     translations along the parent's axes, then as
    spherical

A joint that mimics another has no entry in q: its node moves by multiplier · q + offset of the leader's
entry.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.description.model import Joint, RobotDescription
from roboyard.errors import unknown_name
from roboyard.kinematics._folding import Transform, about_z, along_z, z_to
from roboyard.kinematics.joint_models import Coordinate, coordinates, mimic_source
from roboyard.transforms import Array, matrix_from_quaternion

Indices = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainArrays:
    """Joints and links between one base link and one or more tips; arrays are read-only.

    Sizes: n entries of q (independent joint coordinates), m nodes (moving coordinates, mimics included),
    l links, t tips. Positions are in rad for rotations, in m for translations.
    """

    base_link: str
    """Link whose frame poses are relative to."""
    joint_names: tuple[str, ...]
    """(n) names of the entries of q: depth first, children in file order."""
    lower: Array
    """(n,) lower limits (rad or m), -inf for none."""
    upper: Array
    """(n,) upper limits (rad or m), inf for none."""
    velocity: Array
    """(n,) velocity limits (rad/s or m/s), inf for none."""
    period: Array
    """(n,) 2π where a full turn changes no pose, else 0 (rad)."""
    node_names: tuple[str, ...]
    """(m) names of the coordinates that move the nodes."""
    parent: Indices
    """(m,) parent nodes, -1 for the base; parents come first."""
    is_prismatic: NDArray[np.bool_]
    """(m,) True for a translation along the node's z axis, False for a rotation about it."""
    origin_position: Array
    """(m, 3) positions in the parent nodes' frames with q at zero (m)."""
    origin_rotation: Array
    """(m, 3, 3) rotations in the parent nodes' frames with q at zero."""
    q_index: Indices
    """(m,) entries of q that move the nodes."""
    multiplier: Array
    """(m,) multipliers of mimic joints, else 1."""
    offset: Array
    """(m,) offsets of mimic joints (rad or m), else 0."""
    links: tuple[str, ...]
    """(l) names of the links, base first, depth first."""
    link_node: Indices
    """(l,) nodes that the links are fixed to, -1 for the base."""
    link_position: Array
    """(l, 3) positions of the links in their nodes' frames (m)."""
    link_rotation: Array
    """(l, 3, 3) rotations of the links in their nodes' frames."""
    tips: Indices
    """(t,) entries of `links` that targets refer to."""

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    @property
    def size(self) -> int:
        """Number of entries of q."""
        return len(self.joint_names)

    @property
    def tip_names(self) -> tuple[str, ...]:
        """Names of the tips."""
        return tuple(self.links[i] for i in self.tips)

    def link(self, name: str) -> int:
        """Return the index of a link in `links`.

        Raises:
            ValueError: the chain has no such link; the message lists the nearest.
        """
        if name not in self._link_index:
            raise ValueError(unknown_name("link of the chain", name, self.links))
        return self._link_index[name]

    @cached_property
    def _link_index(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.links)}

    @cached_property
    def nodes(self) -> tuple[NDArray[np.int64], Array]:
        """Arrays of the kernels: (m, 3) parent, is_prismatic, q index.

        (m, 14) position, rotation, multiplier, offset.
        """
        whole = np.stack([self.parent, self.is_prismatic.astype(np.int64), self.q_index], axis=1)
        m = len(self.parent)
        parts = [self.origin_position, self.origin_rotation.reshape(m, 9), self.multiplier[:, None]]
        return whole, np.ascontiguousarray(np.concatenate([*parts, self.offset[:, None]], axis=1))

    @cached_property
    def tip_frames(self) -> tuple[NDArray[np.int64], Array]:
        """(t,) nodes and (t, 12) offsets of the tips, as of `frames`."""
        return self.frames(self.tips)

    def frames(self, links: Iterable[int] | Indices) -> tuple[NDArray[np.int64], Array]:
        """Return (k,) nodes and (k, 12) offsets (position, rotation by rows) of links by index."""
        chosen = np.array(list(links), dtype=np.int64)
        rotation = self.link_rotation[chosen].reshape(len(chosen), 9)
        offsets = np.concatenate([self.link_position[chosen], rotation], axis=1)
        return self.link_node[chosen], np.ascontiguousarray(offsets)

    @cached_property
    def ranges(self) -> Array:
        """(n, 3) lower limit, upper limit and period (rad or m), for the kernels."""
        return np.ascontiguousarray(np.stack([self.lower, self.upper, self.period], axis=1))

    @cached_property
    def middle(self) -> Array:
        """(n,) middle of each range (rad or m); 0 or the limit nearest to it where a side has no limit."""
        both = np.isfinite(self.lower) & np.isfinite(self.upper)
        centre = np.where(both, self.lower, 0.0) / 2 + np.where(both, self.upper, 0.0) / 2
        return np.clip(centre, self.lower, self.upper)


def from_description(
    description: RobotDescription,
    tip_links: str | Sequence[str],
    base_link: str | None = None,
    locked: Mapping[str, float] | None = None,
    *,
    whole_tree: bool = False,
    follow_mimic: bool = True,
) -> ChainArrays:
    """Compile the joints between `base_link` and `tip_links`.

    Args:
        description: the robot.
        tip_links: one link or several, in the order of the targets.
        base_link: an ancestor of every tip; the root link by default.
        locked: coordinates with constant positions (name to rad or m), which are no entries of q.
        whole_tree: include every joint below the base link, not only those that lead to a tip.
        follow_mimic: False makes every mimic joint a coordinate of its own.

    The limits of a mimic joint narrow its leader's, unless the range would be empty.

    Raises:
        ValueError: unknown link or joint, no tip, or a tip that is not below the base link.
        DescriptionError: a joint's axis is zero, or mimic joints form a circle or name no single-DOF joint.
    """
    base = description.root.name if base_link is None else base_link
    tips = [tip_links] if isinstance(tip_links, str) else list(tip_links)
    if not tips:
        raise ValueError(f"tip_links must name at least one link, got {tip_links!r}")
    for name in [base, *tips]:
        if name not in description.link_by_name:
            raise ValueError(unknown_name("link", name, description.link_by_name))
    below = _joints_below(description, base)
    on_path = {joint.name for tip in tips for joint in _path(description, base, tip)}
    joints = [joint for joint in below if whole_tree or joint.name in on_path]
    return _Builder(description, base, locked or {}, follow_mimic).build(joints, tips)


def _joints_below(description: RobotDescription, base: str) -> list[Joint]:
    """Return the joints below `base`, depth first."""
    reached, found = {base}, []
    for joint in description.depth_first_joints:
        if joint.parent in reached:
            reached.add(joint.child)
            found.append(joint)
    return found


def _path(description: RobotDescription, base: str, tip: str) -> list[Joint]:
    """Return the joints from `tip` up to `base`."""
    path, link = [], tip
    while link != base:
        joint = description.parent_joint.get(link)
        if joint is None:
            raise ValueError(f"link {tip!r} is not below {base!r}; choose a base link above every tip")
        path.append(joint)
        link = joint.parent
    return path


@dataclass(frozen=True, kw_only=True, slots=True)
class _Source:
    """Value of a coordinate: multiplier · (entry `leader` of q) + offset; the offset alone for no leader."""

    leader: str | None
    multiplier: float = 1.0
    offset: float = 0.0


class _Builder:
    """Visits the joints once and collects the rows; one object per call."""

    def __init__(
        self, description: RobotDescription, base: str, locked: Mapping[str, float], follow_mimic: bool
    ) -> None:
        self.description = description
        self.base = base
        self.locked = dict(locked)
        self.follow_mimic = follow_mimic
        known = {c.name for joint in description.joints for c in coordinates(joint)}
        for name in self.locked:
            if name not in known:
                raise ValueError(unknown_name("joint coordinate", name, sorted(known)))

    def build(self, joints: Sequence[Joint], tips: Sequence[str]) -> ChainArrays:
        carriers: dict[str, tuple[int, Transform]] = {self.base: (-1, Transform.identity())}
        rows: list[tuple[Coordinate, int, Transform, _Source]] = []
        for joint in joints:
            node, carry = carriers[joint.parent]
            rotation = matrix_from_quaternion(joint.origin.quaternion)
            carry = carry @ Transform.of(joint.origin.position, rotation)
            for coordinate in coordinates(joint):
                turn = z_to(coordinate.axis)
                source = self._source(joint, coordinate)
                here = carry @ turn
                if source.leader is None:
                    move = along_z if coordinate.is_prismatic else about_z
                    carry = here @ move(source.offset) @ turn.inverse()
                else:
                    rows.append((coordinate, node, here, source))
                    node, carry = len(rows) - 1, turn.inverse()
            carriers[joint.child] = (node, carry)
        return self._pack(rows, carriers, tips)

    def _source(self, joint: Joint, coordinate: Coordinate) -> _Source:
        if coordinate.name in self.locked:
            return _Source(leader=None, offset=float(self.locked[coordinate.name]))
        if joint.mimic is None or not self.follow_mimic:
            return _Source(leader=coordinate.name)
        found = mimic_source(self.description, joint, self.locked)
        if found.leader is None:
            assert found.error is not None
            raise found.error
        leader = found.leader.name
        if leader in self.locked:
            return _Source(leader=None, offset=found.multiplier * float(self.locked[leader]) + found.offset)
        return _Source(leader=leader, multiplier=found.multiplier, offset=found.offset)

    def _pack(
        self,
        rows: Sequence[tuple[Coordinate, int, Transform, _Source]],
        carriers: Mapping[str, tuple[int, Transform]],
        tips: Sequence[str],
    ) -> ChainArrays:
        needed = {source.leader for *_, source in rows}
        entries = [c for j in self.description.depth_first_joints for c in coordinates(j) if c.name in needed]
        order = {c.name: i for i, c in enumerate(entries)}
        links = tuple(carriers)
        q_index = np.array([order[source.leader or ""] for *_, source in rows], dtype=np.int64)
        multiplier = np.array([source.multiplier for *_, source in rows], dtype=float)
        offset = np.array([source.offset for *_, source in rows], dtype=float)
        lower, upper = _limits(entries, [row[0] for row in rows], q_index, multiplier, offset)
        prismatic = np.array([c.is_prismatic for c, *_ in rows], dtype=bool)
        return ChainArrays(
            base_link=self.base,
            joint_names=tuple(order),
            lower=lower,
            upper=upper,
            velocity=np.array([c.velocity for c in entries], dtype=float),
            period=_periods(len(entries), q_index, multiplier, prismatic),
            node_names=tuple(c.name for c, *_ in rows),
            parent=np.array([node for _, node, *_ in rows], dtype=np.int64),
            is_prismatic=prismatic,
            origin_position=np.array([t.position for _, _, t, _ in rows], dtype=float).reshape(-1, 3),
            origin_rotation=np.array([t.rotation for _, _, t, _ in rows], dtype=float).reshape(-1, 3, 3),
            q_index=q_index,
            multiplier=multiplier,
            offset=offset,
            links=links,
            link_node=np.array([carriers[name][0] for name in links], dtype=np.int64),
            link_position=np.array([carriers[name][1].position for name in links]),
            link_rotation=np.array([carriers[name][1].rotation for name in links]),
            tips=np.array([links.index(tip) for tip in tips], dtype=np.int64),
        )


def _limits(
    entries: Sequence[Coordinate],
    moved: Sequence[Coordinate],
    q_index: Indices,
    multiplier: Array,
    offset: Array,
) -> tuple[Array, Array]:
    """Return the limits of every entry of q, narrowed by those of its mimic joints."""
    lower = np.array([c.lower for c in entries], dtype=float)
    upper = np.array([c.upper for c in entries], dtype=float)
    for coordinate, i, k, b in zip(moved, q_index, multiplier, offset, strict=True):
        if coordinate.name == entries[i].name or k == 0.0:
            continue
        ends = sorted([(coordinate.lower - b) / k, (coordinate.upper - b) / k])
        low, high = max(lower[i], ends[0]), min(upper[i], ends[1])
        if low <= high:
            lower[i], upper[i] = low, high
    return lower, upper


def _periods(size: int, q_index: Indices, multiplier: Array, prismatic: NDArray[np.bool_]) -> Array:
    """Return 2π for entries that move only hinges, with integer multipliers, else 0."""
    period = np.full(size, 2 * np.pi)
    whole = ~prismatic & (np.abs(multiplier - np.round(multiplier)) < 1e-12)
    period[q_index[~whole]] = 0.0
    return period

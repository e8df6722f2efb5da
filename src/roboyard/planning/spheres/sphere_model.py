"""A robot as spheres on a tree of joints: the arrays of the planning kernels for a group of joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.robot_model import CollisionSphere
from roboyard.errors import ConfigError, unknown_name
from roboyard.kinematics.chain import ChainArrays, from_description
from roboyard.kinematics.joint_models import coordinates
from roboyard.planning.kernels.arrays import Indices, RobotArrays
from roboyard.transforms import Array

FREE_ROTATION, FREE_TRANSLATION = np.pi, 4.0
"""Range on each side of zero, or of a given value, of joints without limits (rad, m)."""

Pair = tuple[str, str]


@dataclass(frozen=True, kw_only=True)
class SphereModel:
    """Spheres, pairs and paddings of a robot, independent of which joints are planned."""

    description: RobotDescription
    spheres: Mapping[str, tuple[CollisionSphere, ...]]
    """Link name to its spheres."""
    ignore: frozenset[Pair]
    """Pairs of links that may touch, names sorted."""
    buffer: float = 0.0
    """Padding of every sphere against the surroundings (m)."""
    self_buffer: Mapping[str, float] = field(default_factory=dict)
    """Link name to the padding against other links (m)."""
    gaps: Mapping[str, float] = field(default_factory=dict)
    """Link name to the largest distance of its collision shapes' surface outside its spheres (m)."""
    is_loose: bool = False
    """Whether some shapes, such as those of held bodies, may end farther outside their spheres."""
    rough: frozenset[Pair] = frozenset()
    """Pairs of links, names sorted, that only exact shapes judge: their spheres are too rough."""
    apart: frozenset[Pair] = frozenset()
    """Pairs of links, names sorted, whose hulls are proven never to touch."""
    overlaps: Mapping[Pair, float] = field(default_factory=dict)
    """Pairs of links, names sorted, to the depth by which a search lets their spheres overlap (m)."""
    retract: Mapping[str, float] = field(default_factory=dict)
    """Joint name to the rest position (rad or m)."""
    locked: Mapping[str, float] = field(default_factory=dict)
    """Joint name to the position of a joint that is never planned (rad or m)."""
    tools: tuple[str, ...] = ()
    """End-effector links."""
    acceleration: float | None = None
    """Limit of every joint (rad/s² or m/s²), where the files give one."""
    jerk: float | None = None
    """Limit of every joint (rad/s³ or m/s³), where the files give one."""

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of all independent joint coordinates, depth first."""
        return tuple(
            c.name
            for joint in self.description.depth_first_joints
            if joint.mimic is None
            for c in coordinates(joint)
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class SphereRobot:
    """The kernels' arrays for a group of joints, with the others at constant positions."""

    model: SphereModel
    chain: ChainArrays
    """Kinematics of the group; `chain.joint_names` is the order of q."""
    links: tuple[str, ...]
    """(l) links with spheres."""
    order: tuple[int, ...]
    """(n) entry of the caller's joint names for each entry of `chain.joint_names`."""
    held: Mapping[str, float]
    """Joint name to the position of every joint outside the group (rad or m)."""
    arrays: RobotArrays
    search_arrays: RobotArrays
    """`arrays` whose pairs may overlap as far as a search may let them; exact shapes judge the rest."""
    rough: tuple[Pair, ...] = ()
    """(r) pairs of links that only exact shapes judge and that the joints move relative to each other."""
    rough_reach: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """(r, n) most that two points of such a pair move relative to each other for each unit of each joint."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """(n) names of the joints in the order of q."""
        return self.chain.joint_names

    def sphere_link(self, sphere: int) -> str:
        """Return the link that a sphere belongs to."""
        return self.links[int(np.searchsorted(self.arrays.start, sphere, side="right")) - 1]


def sphere_robot(
    model: SphereModel,
    joints: Sequence[str],
    held: Mapping[str, float] | None = None,
    tips: Sequence[str] = (),
    around: Mapping[str, float] | None = None,
) -> SphereRobot:
    """Return the arrays of a robot whose named joints move.

    Args:
        model: the robot's spheres and pairs.
        joints: names of the joints that are planned.
        held: positions of other joints (rad or m); those not named have the model's locked position, else
            its rest position.
        around: middle of the range of joints without limits (rad or m); zero by default.
        tips: links that poses refer to; the model's tools by default, else the last link.

    Raises:
        ConfigError: a joint does not exist, follows another one, or no joint is named.
    """
    known = model.coordinate_names
    for name in (*joints, *(held or {})):
        if name not in known and name not in model.description.joint_by_name:
            raise ConfigError(f"{model.description.name}: {unknown_name('joint', name, known)}")
    if not joints or any(name not in known for name in joints):
        wrong = [name for name in joints if name not in known]
        raise ConfigError(
            f"{model.description.name}: joints {wrong or list(joints)} cannot be planned; name joints that "
            f"move and follow no other: {', '.join(known)}"
        )
    others = {}
    for name in known:
        if name not in joints:
            others[name] = float((held or {}).get(name, model.locked.get(name, model.retract.get(name, 0.0))))
    ends = list(tips or model.tools) or [model.description.links[-1].name]
    chain = from_description(model.description, ends, locked=others, whole_tree=True)
    names = [link for link in chain.links if model.spheres.get(link)]
    order = tuple(list(joints).index(name) for name in chain.joint_names)
    arrays = _arrays(model, chain, names, around or {})
    rough, rough_reach = _rough(model, chain, names, arrays)
    return SphereRobot(
        model=model,
        chain=chain,
        links=tuple(names),
        order=order,
        held=others,
        arrays=arrays,
        search_arrays=_with_overlaps(model, names, arrays),
        rough=rough,
        rough_reach=rough_reach,
    )


def _with_overlaps(model: SphereModel, names: list[str], arrays: RobotArrays) -> RobotArrays:
    """Return arrays with smaller paddings of the pairs whose spheres may overlap; the same where none may."""
    named = [(min(names[a], names[b]), max(names[a], names[b])) for a, b in arrays.pairs]
    if not any(pair in model.overlaps for pair in named):
        return arrays
    depths = np.array([model.overlaps.get(pair, 0.0) for pair in named])
    return arrays._replace(pair_pad=arrays.pair_pad - depths)


def _rough(
    model: SphereModel, chain: ChainArrays, names: list[str], arrays: RobotArrays
) -> tuple[tuple[Pair, ...], Array]:
    """Return the rough pairs (r) that move, and how far (r, n) for each unit of each joint."""
    found = [pair for pair in sorted(model.rough) if set(pair) <= set(names)]
    pairs = np.array([[names.index(a), names.index(b)] for a, b in found], dtype=np.int64).reshape(-1, 2)
    reach = _reach(chain, arrays.node, arrays.spheres, arrays.start, arrays.lower, arrays.upper)
    gaps = np.array([model.gaps.get(name, 0.0) for name in names])  # shapes end outside their spheres
    rows = _pair_reach(chain, arrays.node, pairs, np.where(reach > 0, reach + gaps[:, None], reach))
    moving = [bool(row.any()) for row in rows]
    return tuple(pair for pair, moves in zip(found, moving, strict=True) if moves), rows[moving]


def _arrays(
    model: SphereModel, chain: ChainArrays, names: list[str], around_q: Mapping[str, float]
) -> RobotArrays:
    whole, real = chain.nodes
    index = [chain.link(name) for name in names]
    node = chain.link_node[index]
    rows, start, around = [np.zeros((0, 4))], [0], np.zeros((len(names), 4))
    for k, (name, i) in enumerate(zip(names, index, strict=True)):
        own = np.array([(*s.center, s.radius) for s in model.spheres[name]], dtype=float)
        around[k] = _around(own.tobytes())
        for points in (own[:, :3], around[k : k + 1, :3]):
            points[:] = points @ chain.link_rotation[i].T + chain.link_position[i]
        rows.append(own)
        start.append(start[-1] + len(own))
    spheres = np.concatenate(rows)
    lower, upper = bounded_limits(chain, around_q)
    pairs = _pairs(model, node, names)
    reach = _reach(chain, node, spheres, start, lower, upper)
    pad = np.array([model.buffer + model.gaps.get(name, 0.0) for name in names])
    own = np.array([model.self_buffer.get(name, 0.0) + model.gaps.get(name, 0.0) for name in names])
    return RobotArrays(
        whole=whole,
        real=real,
        node=np.ascontiguousarray(node),
        start=np.array(start, dtype=np.int64),
        around=around,
        spheres=spheres,
        pad=pad,
        pair_pad=own[pairs].sum(axis=1),
        pairs=pairs,
        reach=_by_joint(chain, reach),
        pair_reach=_pair_reach(chain, node, pairs, reach),
        lower=lower,
        upper=upper,
    )


def bounded_limits(chain: ChainArrays, around: Mapping[str, float]) -> tuple[Array, Array]:
    """Return (n,) finite lower and upper limits (rad or m), around a value where a joint has none."""
    prismatic = np.zeros(chain.size, dtype=bool)
    prismatic[chain.q_index[chain.is_prismatic]] = True
    free = np.where(prismatic, FREE_TRANSLATION, FREE_ROTATION)
    middle = np.array([around.get(name, 0.0) for name in chain.joint_names])
    lower = np.where(np.isfinite(chain.lower), chain.lower, np.minimum(middle, chain.upper) - free)
    upper = np.where(np.isfinite(chain.upper), chain.upper, np.maximum(middle, chain.lower) + free)
    return np.ascontiguousarray(lower), np.ascontiguousarray(upper)


@lru_cache(maxsize=512)
def _around(spheres: bytes) -> Array:
    """Return the (4,) sphere around (s, 4) spheres of a link, which is the same for all robots of a model."""
    return bounding_sphere(np.frombuffer(spheres).reshape(-1, 4))


def bounding_sphere(spheres: Array) -> Array:
    """Return the (4,) centre and radius of a small sphere around (s, 4) spheres (m).

    Centre moves towards the farthest sphere by shrinking steps (Badoiu and Clarkson, 2003).
    """
    center = spheres[:, :3].mean(axis=0)
    for step in range(1, 60):
        away = spheres[:, :3] - center
        length = np.linalg.norm(away, axis=1)
        far = int(np.argmax(length + spheres[:, 3]))
        if length[far] > 0:
            center = center + away[far] * (1.0 + spheres[far, 3] / length[far]) / (step + 1)
    radius = float((np.linalg.norm(spheres[:, :3] - center, axis=1) + spheres[:, 3]).max())
    return np.array([*center, radius])


def _pairs(model: SphereModel, node: Indices, names: Sequence[str]) -> Indices:
    """Return the (p, 2) pairs of links that can move relative to each other and may not touch."""
    unchecked = model.ignore | model.rough | model.apart
    found = [
        (i, j)
        for i, a in enumerate(names)
        for j, b in enumerate(names[i + 1 :], start=i + 1)
        if node[i] != node[j] and (min(a, b), max(a, b)) not in unchecked
    ]
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _ancestors(chain: ChainArrays, node: int) -> list[int]:
    found = []
    while node >= 0:
        found.append(int(node))
        node = int(chain.parent[node])
    return found


def _reach(
    chain: ChainArrays,
    node: Indices,
    spheres: Array,
    start: Sequence[int] | Indices,
    lower: Array,
    upper: Array,
) -> Array:
    """Return (l, m): largest distance of a link's points from a node's axis, 1 for a translation."""
    out = np.zeros((len(node), len(chain.parent)))
    travel = np.zeros(len(chain.parent))
    for i in np.flatnonzero(chain.is_prismatic):
        ends = np.array([lower[chain.q_index[i]], upper[chain.q_index[i]]]) * chain.multiplier[i]
        travel[i] = np.abs(ends + chain.offset[i]).max()
    for l, first in enumerate(node):
        own = spheres[start[l] : start[l + 1]]
        flat = float((np.hypot(own[:, 0], own[:, 1]) + own[:, 3]).max())
        full = float((np.linalg.norm(own[:, :3], axis=1) + own[:, 3]).max())
        child = -1
        for i in _ancestors(chain, int(first)):
            if child >= 0:
                x, y, z = chain.origin_position[child]
                below = full + travel[child]
                flat, full = float(np.hypot(x, y)) + below, float(np.linalg.norm((x, y, z))) + below
            out[l, i] = 1.0 if chain.is_prismatic[i] else flat
            child = i
    return out


def _by_joint(chain: ChainArrays, reach: Array) -> Array:
    """Return (rows, n) from (rows, m): the nodes of each joint summed."""
    out = np.zeros((len(reach), chain.size))
    for i, (q, k) in enumerate(zip(chain.q_index, chain.multiplier, strict=True)):
        out[:, q] += abs(k) * reach[:, i]
    return out


def _pair_reach(chain: ChainArrays, node: Indices, pairs: Indices, reach: Array) -> Array:
    rows = np.zeros((len(pairs), len(chain.parent)))
    for p, (a, b) in enumerate(pairs):
        above_a, above_b = set(_ancestors(chain, int(node[a]))), set(_ancestors(chain, int(node[b])))
        for i in above_a - above_b:
            rows[p, i] = reach[a, i]
        for i in above_b - above_a:
            rows[p, i] = reach[b, i]
    return _by_joint(chain, rows)


def sorted_pairs(ignore: Mapping[str, Iterable[str]]) -> frozenset[Pair]:
    """Return the pairs of a mapping of links to links, names sorted."""
    return frozenset((min(a, b), max(a, b)) for a, others in ignore.items() for b in others)


def link_contents(model: SphereModel) -> tuple[object, ...]:
    """Return what says whether a robot's links touch: its joints, spheres and ignored pairs."""
    names = [link.name for link in model.description.links if model.spheres.get(link.name)]
    joints = [
        (j.name, j.type, j.parent, j.child, j.origin.position, j.origin.quaternion, j.axis, j.limit, j.mimic)
        for j in model.description.depth_first_joints
    ]
    return joints, [(name, model.spheres[name]) for name in names], sorted(model.ignore)

"""The compiled world of the last episode: a world that is built from the same plans takes it over.

Programs that learn reset their world thousands of times and build it again from the same files. MuJoCo takes
0.3 ms to compile the smallest spec, as long to make an MjData, and longer to free both: more than all else of
such a reset. What a world's first compile was made from, its key, is therefore compared with that of the
world before. The second time that it is the same, the numbers of the compiled model are copied; from the
third time on, spec, model and data are taken over, and the model gets those numbers back, so that nothing of
what happened in between is left.

A program that reads a state between two additions compiles a world that grows then. Its later compiles have
keys, too. Each that came before is made of a spec of its own, which it can be taken over with.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import NamedTuple, dataclass
from roboyard.sim.build.inverse_weights import bound_inverse_weights
from roboyard.sim.build.mesh_assets import MeshAssets
from roboyard.sim.build.planned import Friction, PlannedBody
from roboyard.sim.build.records import BodyRows, Built
from roboyard.sim.pool.analytic_templates import Numbers, numbers_of
from roboyard.sim.pool.base_rows import BaseRows, bases_of
from roboyard.sim.pool.former_arrays import FormerArrays
from roboyard.sim.pool.model_memory import memory_of
from roboyard.sim.pool.plain_rows import PlainRows, rows_of, write
from roboyard.sim.pool.templates import BodyTemplate, row_starts, write_elements

MOST_BYTES = 64 * 2**20
"""Size of a model from which on it is not kept."""


@dataclass(kw_only=True, slots=True, eq=False)
class CompileKey:
    """The input of a first compile."""

    bodies: tuple[PlannedBody, ...]
    settings: tuple[Any, ...]
    """All else, by value: options of the spec, and what else is in it."""

    numbers: dict[int, Numbers | None] = field(default_factory=dict)
    """Those of bodies, by their places, that were compared with others of the same names."""

    compared: int = 0
    """Id of the key that this one was compared with last, not held: each would hold all before it."""
    others: list[int] = field(default_factory=list)
    """Places of bodies with other numbers than those of that key."""

    _poses: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions (n, 3) (m) and quaternions (n, 4), w, x, y, z, of the root links' frames in the world."""
        if self._poses is None:
            quaternions = np.array([body.quaternion for body in self.bodies])
            self._poses = np.array([body.position for body in self.bodies]), quaternions[:, [3, 0, 1, 2]]
        return self._poses

    def is_like(self, other: CompileKey) -> bool:
        """Return whether both lead to the same model but for numbers that `KeptWorld.renew` writes."""
        self.compared, self.others = id(other), []
        return (
            len(self.bodies) == len(other.bodies)
            and self.settings == other.settings
            and all(self._is_akin(other, place) for place in range(len(self.bodies)))
        )

    def _is_akin(self, other: CompileKey, place: int) -> bool:
        """Return whether bodies differ only in numbers of one shape, friction, and where the root link is."""
        one, two = self.bodies[place], other.bodies[place]
        if not one.is_alike_but_friction(two):
            if one.description.root.name != two.description.root.name or not one.is_built_as(two):
                return False
            ours, theirs = self.numbers_at(place), other.numbers_at(place)
            if ours is None or theirs is None or ours.signature != theirs.signature:
                return False
            self.others.append(place)
        if one.frictions == two.frictions:
            return True
        return list(map(_form_of, one.frictions)) == list(map(_form_of, two.frictions))

    def numbers_at(self, place: int) -> Numbers | None:
        """Return the numbers of the body at a place; None where it has more than one simple shape."""
        if place not in self.numbers:
            body = self.bodies[place]
            self.numbers[place] = numbers_of(body.description, body.options)
        return self.numbers[place]


def _form_of(friction: Friction) -> tuple[Any, ...]:
    """Return what two settings of friction must have in common for one to replace the other."""
    link, sliding, spinning, rolling = friction
    return link, sliding is None, spinning is None, rolling is None, bool(spinning), bool(rolling)


Find = Callable[[PlannedBody, Numbers], BodyTemplate | None]
"""Returns the template of a body with these numbers; None where there is none."""
Change = tuple[int, BodyTemplate, BodyTemplate]
"""Place of a body among all, its template, and the one whose numbers the model has."""


class Changes(NamedTuple):
    """The bodies whose numbers are others."""

    plain: tuple[int, ...]
    """Places among all of those whose numbers are written at once; see `plain_rows`."""
    others: list[Change]


@dataclass(kw_only=True, slots=True, eq=False)
class KeptWorld:
    """A compiled spec as it was right after its first compile."""

    key: CompileKey
    spec: Any
    assets: MeshAssets
    built: tuple[Built, ...]
    """The elements of all bodies."""
    extras: Any
    """Elements of other parts of the world."""
    model: Any
    data: Any
    of_arrays: dict[str, Any]
    """Objects that worlds made of the arrays of both; see `Engine.of_arrays`."""
    memory: np.ndarray
    """The bytes of the model's arrays."""
    numbers: np.ndarray
    """A copy of them."""
    inertia: float
    """Mean inertia."""
    bases: BaseRows
    """Rows of the bases of all bodies."""
    rows: list[BodyRows] | None = None
    """Those of all bodies, once they were looked up."""
    templates: dict[int, BodyTemplate] = field(default_factory=dict)
    """Those of bodies whose numbers were written, by their places."""
    starts: dict[int, dict[str, int]] = field(default_factory=dict)
    """First rows of these bodies in each kind of array."""
    plain: dict[tuple[int, ...], PlainRows] = field(default_factory=dict)
    """Rows of bodies whose numbers were written at once, by their places."""

    def changes(self, key: CompileKey, find: Find) -> Changes | None:
        """Return the bodies whose numbers are others by a key; None where they cannot be written."""
        if key.compared != id(self.key) and not key.is_like(self.key):
            return None
        plain, others = list[int](), list[Change]()
        for place in key.others:
            numbers, former = key.numbers_at(place), self.templates.get(place)
            if numbers is None:
                return None
            if numbers.is_plain:  # and so were those that are there, which have the same signature
                plain.append(place)
                continue
            if former is None:
                ours = self.key.numbers_at(place)
                former = None if ours is None else find(self.key.bodies[place], ours)
            template = find(key.bodies[place], numbers)
            if template is None or former is None or template.family is not former.family:
                return None
            others.append((place, template, former))
        return Changes(tuple(plain), others)

    def renew(self, key: CompileKey, changes: Changes) -> None:
        """Give model and data the numbers of a compile with this key.

        Only the extent of the scene, from which viewers choose where they look from, stays as it was.

        Args:
            key: like that of this world.
            changes: bodies whose numbers are others.
        """
        model, data = self.model, self.data
        self.memory[:] = self.numbers
        model.stat.meaninertia = self.inertia
        arrays = dict[str, np.ndarray]()
        has_changed = bool(changes.plain or changes.others)
        if changes.plain:
            self._write_plain(key, changes.plain)
        for place, template, former in changes.others:
            self._change(place, template, former, arrays)
        positions, quaternions = key.poses
        for built, position, wxyz in zip(self.built, positions, quaternions, strict=True):
            element = built.links[0].element
            element.pos, element.quat = position, wxyz  # which others may have moved since
        is_moved = self.bases.move(model, self.key.poses, key.poses)
        mujoco.mj_resetData(model, data)
        if is_moved or has_changed:
            mujoco.mj_setConst(model, data)
            bound_inverse_weights(model)
            mujoco.mj_resetData(model, data)
        if has_changed:
            model.stat.meaninertia = self.inertia = float(model.dof_M0.mean()) if model.nv else self.inertia

    def _write_plain(self, key: CompileKey, places: tuple[int, ...]) -> None:
        """Write the numbers of bodies of simple shapes, by their places, into the model and the spec."""
        numbers = [one for place in places if (one := key.numbers_at(place)) is not None]
        rows = self.plain.get(places)
        if rows is None:
            bodies = [self.built[place].links[0].element.id for place in places]
            rows = self.plain[places] = rows_of(self.model, bodies, numbers)
        write(self.model, rows, numbers)
        for place, one in zip(places, numbers, strict=True):
            record = self.built[place].links[0]
            record.link, record.mass = key.bodies[place].description.root, one.mass
            if one.mass is not None:
                record.element.mass, record.element.inertia = one.mass.mass, one.mass.principal
            for geom in record.geoms:
                geom.size = one.sizes
            self.templates.pop(place, None)

    def _change(
        self, place: int, template: BodyTemplate, former: BodyTemplate, arrays: dict[str, np.ndarray]
    ) -> None:
        """Write the numbers of a body's template into the model and the spec.

        Args:
            place: of the body among all.
            template: of the body.
            former: template of the numbers that are there.
            arrays: those of the model that were looked up so far, by name.
        """
        record, model = self.built[place].links[0], self.model
        self.templates[place] = template
        record.link, record.mass = template.description.root, template.mass
        write_elements(record.element, record.geoms, template, former)
        starts = self.starts.get(place)
        if starts is None:
            starts = self.starts[place] = row_starts(model, record.element.id)
        for name in {*template.varied, *former.varied}:
            values, block = arrays.get(name), template.blocks[name]
            if values is None:
                values = arrays[name] = getattr(model, name)
            start = starts[template.kinds[name]]
            values[start : start + len(block)] = block

    def is_now(self, key: CompileKey) -> None:
        """Note that spec and model agree with this key, and that the model has further numbers of it."""
        self.key = key
        self.numbers[:] = self.memory


Compile = tuple[CompileKey, KeptWorld | None]
"""The input of a compile, and its world; None where the key was the first of its kind."""


@dataclass(kw_only=True, slots=True, eq=False)
class FormerWorld:
    """The rest of a world that another one replaces."""

    compiles: tuple[Compile, ...]
    """All of that world, in order."""
    arrays: FormerArrays | None = None
    """Its arrays, where no compile kept them."""

    def compile_like(self, key: CompileKey, place: int) -> Compile | None:
        """Return the compile at a place among all; None where it was made from another input."""
        if place >= len(self.compiles):
            return None
        found = self.compiles[place]
        return found if key.is_like(found[0]) else None


class Compiles:
    """The compiles of one world, and those of the one that it replaces."""

    def __init__(self) -> None:
        self.former: FormerWorld | None = None
        """The world that this one replaces, as long as all compiles of this one were also its own."""
        self._own: list[Compile] | None = []

    @property
    def are_known(self) -> bool:
        """Whether each compile so far can be compared with those of other worlds."""
        return self._own is not None

    def repeated(self, key: CompileKey | None) -> Compile | None:
        """Return the compile of the world before that the next one repeats, if all were alike so far."""
        found = None
        if key is not None and self.former is not None and self._own is not None:
            found = self.former.compile_like(key, len(self._own))
        if found is None:
            self.former = None
        return found

    def take_arrays(self) -> FormerArrays | None:
        """Return the arrays of the world before, which the first compile may use."""
        former = self.former
        if former is None:
            return None
        arrays, former.arrays = former.arrays, None
        return arrays

    def needs_spec(self, known: Compile | None) -> bool:
        """Return whether a later compile needs a spec of its own: to be kept, or since the one before is.

        Args:
            known: the result of `repeated`.
        """
        return bool(self._own) and (known is not None or self._own[-1][1] is not None)

    def note(self, key: CompileKey | None, kept: KeptWorld | None) -> None:
        """Note a compile; without a key, this and later ones cannot be compared."""
        if key is None:
            self._own = None
        elif self._own is not None:
            self._own.append((key, kept))

    def of_next(self, arrays: FormerArrays) -> FormerWorld:
        """Return what the next world may take over, where specs are as they were compiled.

        Args:
            arrays: the present arrays.
        """
        own = self._own or ()
        later = () if self.former is None else self.former.compiles[len(own) :]
        compiles = (*own, *later) if own else ()
        is_kept = any(kept is not None and kept.model is arrays.model for _, kept in compiles)
        return FormerWorld(compiles=compiles, arrays=None if is_kept else arrays)


def keep(
    key: CompileKey,
    spec: Any,
    assets: MeshAssets,
    built: Sequence[Built],
    extras: Any,
    model: Any,
    data: Any,
    of_arrays: dict[str, Any],
) -> KeptWorld | None:
    """Return a compiled world to be taken over later; None for one that is too large.

    Args:
        key: what it was compiled from.
        spec: its spec, which must not change any more.
        assets: meshes of the spec.
        built: elements of all bodies.
        extras: elements of other parts of the world.
        model: its MjModel, just compiled.
        data: its MjData.
        of_arrays: the `Engine.of_arrays` of its world.
    """
    memory = memory_of(model)
    if memory is None or memory.nbytes > MOST_BYTES:
        return None
    return KeptWorld(
        key=key,
        spec=spec,
        assets=assets,
        built=tuple(built),
        extras=extras,
        model=model,
        data=data,
        of_arrays=of_arrays,
        memory=memory,
        numbers=memory.copy(),
        bases=bases_of(model, built),
        inertia=float(model.stat.meaninertia),
    )


def copy_state(model: Any, data: Any, now: Any) -> None:
    """Give the bodies of a smaller world, which are the first of another, the state that they had there.

    MuJoCo does so where it compiles a spec again.

    Args:
        model: MjModel of the smaller world.
        data: its MjData.
        now: the MjData that is written.
    """
    dofs = model.nv
    now.time = data.time
    now.qpos[: model.nq], now.qvel[:dofs] = data.qpos, data.qvel
    now.qacc_warmstart[:dofs], now.qfrc_applied[:dofs] = data.qacc_warmstart, data.qfrc_applied
    now.xfrc_applied[: model.nbody] = data.xfrc_applied

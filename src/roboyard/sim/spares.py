"""Spare bodies: a world to which loose bodies are added one by one compiles a few more of them beforehand.

A compile costs MuJoCo time that grows with the square of the number of bodies. When one compile after another
is due to new loose bodies (one link, free), the next one gets some spares of the same make at the end of the
spec, parked: they touch nothing, no ray meets them, nothing draws them. A body added later takes the first
spare over: its numbers go into MuJoCo's arrays, where they are what a compile would have put there, because
they come from a compile of that body alone (its mould). A body that fits no spare compiles as ever.

Spares lie behind all bodies in every array, so that rows of bodies do not move when spares go. They go with
the next compile, after some steps without use, and when somebody asks for MuJoCo's own arrays
(`Engine.model`, `Engine.data`) or for the spec.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from roboyard.poses import Array, to_wxyz
from roboyard.sim.moulds import Mould, is_loose, make_mould, row_starts
from roboyard.sim.records import BuildOptions, Built, BuiltLink
from roboyard.urdf.model import RobotDescription

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.engine import Engine

FEWEST = 8
"""Spares at least; else as many as there are bodies, so that compiles become rarer as they get dearer."""
STREAK = 3
"""Compiles in a row that loose bodies alone made necessary, the one with spares included."""
IDLE_STEPS = 200
"""Steps after which spares that nobody takes go."""
KEPT_MOULDS = 16
PARKED_FIELDS = ("geom_contype", "geom_conaffinity", "geom_rgba", "body_contype", "body_conaffinity")
"""What tells a parked body from one in use."""
_NAME = "spare{}"


@dataclass(kw_only=True, slots=True, eq=False)
class Spare:
    """Rows of one body in MuJoCo's arrays, and its elements in the spec."""

    number: int
    mould: Mould
    """What its elements in the spec say."""
    element: Any
    free_joint: Any
    geoms: list[Any]
    owner: int = -1
    """Id of the body that lives here; -1 while it is free."""
    is_pristine: bool = True
    """Nobody has had it yet."""
    starts: dict[str, int] = field(default_factory=dict)
    """First row by kind of array."""


class Spares:
    """The spares of one world."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._slots: list[Spare] = []
        self._used = 0
        self._fresh: list[tuple[Body, BuildOptions]] = []
        self._mixed = False
        self._streak = 0
        self._patience = STREAK
        self._idle = 0
        self._moulds: list[Mould] = []
        self._arrays: dict[str, np.ndarray] = {}

    @property
    def free(self) -> int:
        """How many wait to be taken."""
        return len(self._slots) - self._used

    # ------------------------------------------------------------------------------------ coming and going

    def note(self, body: Body, options: BuildOptions | None) -> None:
        """A body was added that waits for a compile."""
        if options is not None and body.description is not None and is_loose(body.description, options):
            self._fresh.append((body, options))
        else:
            self._mixed = True

    def forget(self, body: Body) -> None:
        """A body goes before or at the next compile."""
        self._fresh = [item for item in self._fresh if item[0] is not body]

    def tick(self, steps: int) -> None:
        """Time passes; spares that are not needed go."""
        if self._idle > IDLE_STEPS:
            self._drop()
            self._streak = 0
            self._engine.mark_stale()
        self._idle += steps

    def dismiss(self) -> None:
        """Somebody wants MuJoCo's arrays or the spec as they are without spares."""
        if self.free:
            self._drop()
            self._discourage()
            self._engine.mark_stale()

    def prepare(self, spec: Any) -> int:
        """Last edits of the spec before a compile; how many shapes the new spares have together."""
        fresh, mixed = self._fresh, self._mixed
        self._fresh, self._mixed = [], False
        if self.free:
            self._discourage()
        self._drop()
        self._streak = self._streak + 1 if fresh and not mixed else 0
        self._slots, self._used, self._idle = [], 0, 0
        if self._streak < self._patience or spec.sensors or _may_sleep(spec):
            return 0
        body, options = fresh[-1]
        assert body.description is not None
        mould = self._mould(body.description, options)
        if mould is None:
            return 0
        record = body.built.links[0]
        own = Spare(
            number=0,
            mould=mould,
            element=record.element,
            free_joint=body.built.free_joint,
            geoms=[*record.geoms, *record.visuals],
            owner=body.id,
            is_pristine=False,
        )
        count = max(FEWEST, len(fresh), len(self._engine.body_by_id))
        given = mould.given()
        self._slots = [own, *(self._add(spec, mould, given, record.element, 1 + k) for k in range(count))]
        self._used = 1
        return count * len(mould.geoms)

    def settle(self, model: Any) -> None:
        """After a compile: see where spares lie, and park them."""
        self._arrays = {}
        if not self._slots:
            return
        self._arrays = {name: getattr(model, name) for name in self._slots[0].mould.blocks}
        for slot in self._slots:
            slot.starts = row_starts(model, slot.element.id)
        if not self._slots[0].mould.is_like(model, self._slots[0].starts):
            del self._slots[0]  # the body was changed after it was made: it cannot become a spare
            self._used = 0
        for slot in self._slots[self._used :]:
            self._park(slot)
        self._weigh()

    def _add(
        self, spec: Any, mould: Mould, given: tuple[dict[str, Any], list[Any]], place: Any, number: int
    ) -> Spare:
        name = _NAME.format(number)
        element = spec.worldbody.add_body(name=name, pos=place.pos, quat=place.quat, **given[0])
        joint = element.add_freejoint(name=name, align=0)
        geoms = [element.add_geom(**fields) for fields in given[1]]
        for mesh in mould.meshes:
            self._engine.assets.retain(mesh)
        return Spare(number=number, mould=mould, element=element, free_joint=joint, geoms=geoms)

    def _drop(self) -> None:
        """Take free spares out of the spec, all at once: a single one costs as much."""
        going = self._slots[self._used :]
        self._slots = self._slots[: self._used]
        if not going:
            return
        spec = self._engine.raw_spec
        frame = spec.worldbody.add_frame()
        for slot in going:
            slot.element.set_frame(frame)
        spec.delete(frame)
        for slot in going:
            for mesh in slot.mould.meshes:
                self._engine.assets.release(mesh)

    def _discourage(self) -> None:
        """Spares went unused: it takes longer until there are some again."""
        self._streak = 0
        self._patience *= 2

    def _mould(self, description: RobotDescription, options: BuildOptions) -> Mould | None:
        for mould in self._moulds:
            if mould.is_of(description, options):
                return mould
        mould = make_mould(description, options)
        if mould is not None:
            self._moulds = [mould, *self._moulds[: KEPT_MOULDS - 1]]
        return mould

    # --------------------------------------------------------------------------------------------- in use

    def take(
        self,
        description: RobotDescription,
        prefix: str,
        position: Array,
        quaternion: Array,
        options: BuildOptions,
    ) -> Built | None:
        """Make the next spare the body of a description; None where there is none or it does not fit.

        Arguments as of `roboyard.sim.build.build`.
        """
        if self._engine.is_stale or not self.free or not is_loose(description, options):
            return None
        if position.shape != (3,) or not np.isfinite(position).all():
            return None  # the compile says what is wrong
        slot, mould = self._slots[self._used], self._mould(description, options)
        if mould is None or not mould.fits(slot.mould):
            return None
        root = description.root
        wxyz = to_wxyz(quaternion)
        if not slot.is_pristine or slot.mould is not mould:
            mould.write_elements(slot.element, slot.geoms)
        slot.element.name, slot.free_joint.name = f"{prefix}{root.name}", f"{prefix}{root.name}/free"
        slot.element.pos, slot.element.quat = position, wxyz
        names = PARKED_FIELDS if slot.is_pristine and slot.mould is mould else mould.blocks
        for name in names:
            block, start = mould.blocks[name], slot.starts[mould.kinds[name]]
            self._arrays[name][start : start + len(block)] = block
        slot.mould, slot.is_pristine = mould, False
        row, first = slot.starts["body"], slot.starts["qpos"]
        pose = np.concatenate([position, wxyz])
        arrays, data = self._arrays, self._engine.live_data
        arrays["body_pos"][row], arrays["body_quat"][row] = pose[:3], pose[3:]
        for values in (arrays["qpos0"], arrays["qpos_spring"], data.qpos):
            values[first : first + 7] = pose
        self._rest(slot)
        self._used += 1
        self._idle = 0
        self._weigh()
        record = BuiltLink(
            name=root.name,
            parent=-1,
            element=slot.element,
            link=root,
            geoms=slot.geoms[: mould.collisions],
            visuals=slot.geoms[mould.collisions :],
            meshes=list(mould.meshes),
            mass=mould.mass,
        )
        return Built(links=[record], free_joint=slot.free_joint, notes=list(mould.notes), dofs=6)

    def settle_in(self, body: Body) -> None:
        """The body that took the last spare has its id now."""
        self._slots[self._used - 1].owner = body.id

    def give_back(self, body: Body) -> bool:
        """Make a body a spare again; only the last of all can become one."""
        slot = self._slots[self._used - 1] if self._used else None
        if slot is None or slot.owner != body.id or self._engine.is_stale:
            return False
        if self._engine.would_be_pile(more_dofs=0) and not self._engine.would_be_pile(more_dofs=-6):
            return False  # contacts turn hard again: their numbers are in the spec
        self._used -= 1
        self._idle = 0
        slot.owner = -1
        slot.element.name = slot.free_joint.name = _NAME.format(slot.number)
        self._rest(slot)
        self._park(slot)
        self._weigh()
        return True

    def _park(self, slot: Spare) -> None:
        """Out of the way: nothing touches it, no ray meets it, nothing draws it."""
        geoms = slice(slot.starts["geom"], slot.starts["geom"] + len(slot.geoms))
        arrays = self._arrays
        for name in PARKED_FIELDS:
            arrays[name][geoms if name.startswith("geom") else slot.starts["body"]] = 0

    def _rest(self, slot: Spare) -> None:
        """No velocity, nothing that pushes, nothing remembered of the last step."""
        data, first = self._engine.live_data, slot.starts["dof"]
        for values in (data.qvel, data.qacc, data.qacc_warmstart, data.qfrc_applied):
            values[first : first + 6] = 0.0
        data.xfrc_applied[slot.starts["body"]] = 0.0

    def _weigh(self) -> None:
        """Spares count neither for the mass of the whole world nor for its mean inertia.

        By the latter MuJoCo measures how far its solvers have come.
        """
        masses, inertias = self._arrays["body_mass"], self._arrays["dof_M0"]
        if self.free:
            starts = self._slots[self._used].starts
            masses, inertias = masses[: starts["body"]], inertias[: starts["dof"]]
        self._arrays["body_subtreemass"][0] = masses.sum()
        self._engine.live_model.stat.meaninertia = (
            float(inertias.sum()) / len(inertias) if len(inertias) else 1.0
        )


def _may_sleep(spec: Any) -> bool:
    return bool(spec.option.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP))

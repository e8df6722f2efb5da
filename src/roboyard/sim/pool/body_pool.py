"""Spare bodies: a world to which bodies are added one by one compiles a few more of them beforehand.

A compile costs MuJoCo time that grows with the square of the number of bodies. When one compile after another
is due to new bodies, the next one gets some spares of the same makes at the end of the spec, parked: nothing
touches them, no ray meets them, nothing draws them. A body added later takes over the first spare of its
make. Its numbers go into MuJoCo's arrays, where they are what a compile would have put there: they come from
a compile of that body alone (its mould) or follow from its sizes (its casting). Spares before that one are
passed over for good, so that the bodies of a world lie in the order of their ids. What fits no spare compiles
as ever.

Spares of bodies with joints are of that very description, and wait only where steps between additions are
few: each step costs as much for them as for a body in use.

A body that is removed is parked too if it was a spare or has one link. Whatever is parked goes with the next
compile, after some steps in which nobody came or went, and when somebody asks for MuJoCo's own arrays
(`Engine.model`, `Engine.data`) or for the spec.
"""

from __future__ import annotations

from collections import Counter, deque
from itertools import cycle, islice
from typing import Any

import mujoco
import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.sim.build.records import BuildOptions, Built, BuiltLink
from roboyard.sim.pool.rows import PooledBody, PoolRows, add_pooled_body, is_apart
from roboyard.sim.pool.template_cache import TemplateCache
from roboyard.sim.pool.templates import BodyTemplate, can_wait
from roboyard.sim.protocols import EngineBody, PoolEngine
from roboyard.transforms import Array, to_wxyz

MESH = 4
"""Bodies of one link that cost as much to compile as a mesh."""
FEWEST, FEWEST_WITH_JOINTS = 8, 3
MORE, MOST = 32, 600
"""Spares: as many as there are bodies, but at least `FEWEST`, at most `MORE` and half as many as bodies, and
never more than `MOST` unless as many came at once.

Thus compiles become rarer as they get dearer, and steps do not get much dearer for what is parked."""
STREAK = 3
"""Compiles in a row that new bodies alone made necessary, the one with spares included."""
IDLE_STEPS, IDLE_STEPS_WITH_JOINTS = 200, 20
"""Steps without coming and going after which what is parked goes."""
HASTE = 4
"""Steps between additions up to which spares with joints pay."""
REMEMBERED = 12
"""Additions by which the makes of spares are chosen: those that were seen twice."""
_NAME, _GONE = "spare{}", "gone{}"

Recent = tuple[RobotDescription, BuildOptions]


class BodyPool:
    """The spares of one world."""

    def __init__(self, engine: PoolEngine) -> None:
        self._engine = engine
        self._rows = PoolRows(engine)
        self._slots: list[PooledBody] = []
        self._next = 0
        """First spare that may be taken; those before it have an owner or were passed over."""
        self._slot_of: dict[int, PooledBody] = {}
        """By id of the body that lives there."""
        self._gone: list[Built] = []
        """What removed bodies have left in the spec."""
        self._fresh: set[int] = set()
        """Bodies that came since the last compile and wait for the next."""
        self._mixed = False
        self._streak = 0
        self._patience = STREAK
        self._idle = 0
        self._recent: deque[Recent] = deque(maxlen=REMEMBERED)
        self._moulds = TemplateCache()
        self._steps: deque[float] = deque(maxlen=STREAK)
        """Between the last additions, and before the first of them."""
        self._time = 0.0
        """Of the world, when somebody came last; s."""
        self._with_joints = False
        """Whether any spare has joints."""
        self._taken = 0
        """How many spares were taken in all."""
        self._eager = False
        """Whether the next compile with new bodies gets spares in any case."""

    @property
    def free(self) -> int:
        """How many wait to be taken."""
        return len(self._slots) - self._next

    @property
    def inactive(self) -> int:
        """How many bodies lie in MuJoCo's arrays that are nobody's."""
        return len(self._slots) - len(self._slot_of) + len(self._gone)

    @property
    def history(self) -> tuple[Recent, ...]:
        """What came lately, if that was worth spares, for a world that takes this one's place."""
        return tuple(self._recent) if self._taken >= STREAK else ()

    def restore_history(self, history: tuple[Recent, ...]) -> None:
        """Expect what came to the world whose place this one takes."""
        self._recent.extend(history)
        self._eager = bool(history)

    # ------------------------------------------------------------------------------------ coming and going

    def note(self, body: EngineBody, options: BuildOptions | None) -> None:
        """A body was added that waits for a compile."""
        if options is not None and body.description is not None and can_wait(body.description, options):
            self._fresh.add(body.id)
            self._remember(body.description, options)
        else:
            self._mixed = True

    def _remember(self, description: RobotDescription, options: BuildOptions) -> None:
        self._recent.append((description, options))
        now = self._engine.time
        self._steps.append((now - self._time) / self._engine.timestep)
        self._time = now
        self._idle = 0

    def tick(self, steps: int) -> None:
        """Time passes; what is parked and not needed goes."""
        if self._idle > (IDLE_STEPS_WITH_JOINTS if self._with_joints else IDLE_STEPS):
            self._drop()
            self._streak = 0
            self._engine.mark_stale()
        self._idle += steps

    def clear(self) -> None:
        """Somebody wants MuJoCo's arrays or the spec as they are without anything parked."""
        if self.inactive:
            if self.free:
                self._discourage()
            self._drop()
            self._engine.mark_stale()

    def prepare(self, spec: Any) -> int:
        """Last edits of the spec before a compile; how many shapes the new spares have together."""
        fresh, mixed = len(self._fresh), self._mixed
        self._fresh.clear()
        self._mixed = False
        if 2 * self._next < len(self._slots):
            self._discourage()
        elif self._slots:
            self._patience = STREAK
        self._drop()
        self._streak = self._streak + 1 if fresh and not mixed else 0
        is_first = self._eager and fresh > 0
        if is_first:
            self._streak, self._eager = self._patience, False
        self._idle = 0
        if self._streak < self._patience or spec.sensors or _may_sleep(spec):
            return 0
        templates = self._wanted()
        if not templates:
            return 0
        self._with_joints = any(template.description.joints for template in templates)
        fewest = FEWEST_WITH_JOINTS if self._with_joints else REMEMBERED if is_first else FEWEST
        size = self._size()
        count = max(fewest, fresh, min(size, MORE + size // 2, MOST))
        for number, template in enumerate(islice(cycle(templates), count)):
            self._slots.append(add_pooled_body(spec, self._engine.assets, template, _NAME.format(number)))
        return sum(slot.template.counts["geom"] for slot in self._slots)

    def settle(self) -> None:
        """After a compile: see where spares lie, and park them."""
        self._rows.look(self._slots)

    def _size(self) -> int:
        """What a compile costs, in bodies of one link; bodies alone if spares, with joints, cost steps."""
        bodies = self._engine.body_by_id.values()
        if self._with_joints:
            return len(bodies)
        return sum(len(body.built.links) for body in bodies) + MESH * self._engine.assets.count

    def update_inertia(self) -> None:
        """Inertias were written: what is parked counts for nothing."""
        if self.inactive:
            self._rows.update_inertia()

    def _wanted(self) -> list[BodyTemplate]:
        """Moulds like those of the last additions, without makes that came only once."""
        hasty = max(self._steps) < HASTE + 0.5
        jointed = [description for description, _ in self._recent if description.joints]
        recent = ((d, o) for d, o in self._recent if not d.joints or (hasty and jointed.count(d) > 1))
        found = [self._moulds.find(description, options) for description, options in recent]
        has = self._engine.assets.has  # meshes of bodies that have gone are not there
        there = (m for m in found if m is not None and (m.description.joints or all(map(has, m.meshes))))
        templates = [template.family for template in there]
        seen = Counter(template.make for template in templates)
        return [template for template in templates if seen[template.make] > 1]

    def _drop(self) -> None:
        """Take all that is parked out of the spec, all at once: a single one costs as much."""
        going = [slot for slot in self._slots if slot.owner < 0]
        elements = [slot.element for slot in going] + [built.links[0].element for built in self._gone]
        meshes = [mesh for slot in going for mesh in slot.template.meshes]
        meshes += [mesh for built in self._gone for mesh in built.links[0].meshes]
        self._slots, self._next, self._slot_of, self._gone = [], 0, {}, []
        self._with_joints = False
        if not elements:
            return
        spec = self._engine.raw_spec
        frame = spec.worldbody.add_frame()
        for element in elements:
            element.set_frame(frame)
        spec.delete(frame)
        for mesh in meshes:
            self._engine.assets.release(mesh)

    def _discourage(self) -> None:
        """Spares went unused: it takes longer until there are some again."""
        self._streak = 0
        self._patience *= 2

    # --------------------------------------------------------------------------------------------- in use

    def take(
        self,
        description: RobotDescription,
        prefix: str,
        position: Array,
        quaternion: Array,
        options: BuildOptions,
    ) -> Built | None:
        """Make a spare the body of a description; None where there is none that fits.

        Arguments as of `roboyard.sim.build.bodies.build`. `activate` has to follow.
        """
        if self._engine.is_stale or not self.free or not can_wait(description, options):
            return None
        if position.shape != (3,) or not np.isfinite(position).all():
            return None  # the compile says what is wrong
        template = self._moulds.find(description, options)
        if template is None:
            return None
        make, slots = template.make, self._slots
        fitting = (
            k for k in range(self._next, len(slots)) if slots[k].template.make == make and slots[k].is_free
        )
        found = next(fitting, None)
        if found is None:
            return None
        slot, root = slots[found], description.root
        self._rows.fill(slot, template, options, position, to_wxyz(quaternion))
        slot.rename(prefix)
        self._next = found + 1
        self._taken += 1
        self._remember(description, options)
        if slot.built is not None:
            return slot.built
        record = BuiltLink(
            name=root.name,
            parent=-1,
            element=slot.element,
            link=root,
            geoms=slot.geoms[: template.collisions],
            visuals=slot.geoms[template.collisions :],
            meshes=list(template.meshes),
            mass=template.mass,
        )
        dofs = 0 if slot.free_joint is None else 6
        return Built(links=[record], free_joint=slot.free_joint, notes=list(template.notes), dofs=dofs)

    def activate(self, body: EngineBody) -> None:
        """The body that took the last spare has its id now."""
        slot = self._slots[self._next - 1]
        slot.owner = body.id
        self._slot_of[body.id] = slot

    def take_back(self, body: EngineBody) -> bool:
        """Park a body that was removed from the world; False where its elements have to go now."""
        self._fresh.discard(body.id)
        engine, built = self._engine, body.built
        if engine.is_stale or not is_apart(body, engine.live_model):
            return False
        if engine.would_be_pile(more_dofs=0) and not engine.would_be_pile(more_dofs=-built.dofs):
            return False  # contacts turn hard again: their numbers are in the spec
        slot = self._slot_of.pop(body.id, None)
        if slot is None and (len(built.links) > 1 or len(self._gone) > max(FEWEST, len(engine.body_by_id))):
            return False
        self._idle = 0
        if slot is None:
            self._rows.park_body(built, _GONE.format(len(self._gone)))
            self._gone.append(built)
            return True
        self._rows.park(slot)
        while self._next and self._slots[self._next - 1].is_free:
            self._next -= 1
        return True


def _may_sleep(spec: Any) -> bool:
    return bool(spec.option.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP))

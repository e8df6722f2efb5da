"""The body pool: a world to which bodies are added one by one compiles some more of them in advance.

A compile takes MuJoCo time that grows with the square of the number of bodies. After several compiles in a
row that only new bodies made necessary, the next one gets pooled bodies of the same layouts at the end of
the spec. Pooled bodies are inactive: they do not collide, rays do not hit them and they are not rendered. A
body that is added later takes the first pooled body of its layout. Its numbers are written into MuJoCo's
arrays, equal to those that a compile would have written: they come from a compile of that body alone (its
template) or are computed from its sizes (an analytic template). Pooled bodies before the one taken are never
used, so that the bodies of a world are in the order of their ids. A body that fits no pooled body is
compiled as without a pool.

Pooled bodies with joints have one exact description, and are compiled only while few steps pass between
additions: each step costs as much for them as for an active body.

A body that is removed while the spec waits for its compile is deleted with others before that. Any other
removed body becomes inactive, too, if it came from the pool or has one link. One of several links does where
it is the newest and nothing of its elements has changed but friction and inertias of motors: the next like it
takes its rows. All inactive bodies are deleted with the next compile, after some steps without additions and
removals, and when MuJoCo's own arrays (`Engine.model`, `Engine.data`) or the spec are read.

`benchmarks/pool.py` measures the gain.
"""

from __future__ import annotations

import sys
from collections import Counter, deque
from itertools import cycle, islice
from math import isfinite
from typing import Any

from roboyard._mujoco import mujoco
from roboyard.description.model import RobotDescription
from roboyard.sim.build.bodies import discard, is_plain
from roboyard.sim.build.planned import PlannedBody
from roboyard.sim.build.records import BuildOptions, Built, BuiltLink
from roboyard.sim.pool.analytic_templates import Numbers
from roboyard.sim.pool.rows import PooledBody, PoolRows, add_pooled_body, is_apart
from roboyard.sim.pool.template_cache import TemplateCache
from roboyard.sim.pool.templates import BodyTemplate, is_poolable
from roboyard.sim.protocols import EngineBody, PoolEngine
from roboyard.transforms import Array, to_wxyz

MESH = 4
"""Compile cost of a mesh, in bodies of one link."""
FEWEST, FEWEST_ARTICULATED = 8, 3
MORE, MOST = 32, 600
"""Number of pooled bodies: as many as there are bodies, but at least `FEWEST`, at most `MORE` and half as
many as bodies, and never more than `MOST` unless as many were added at once.

So compiles become rarer as they become more expensive, while steps do not become much slower. Where bodies
are removed before others are added, the fewest are enough."""
STREAK = 3
"""Compiles in a row that only new bodies made necessary, the one with pooled bodies included."""
MORE_AT_START = 2
"""Such compiles that are needed besides before the first step, where programs that reset read what they load:
the next world takes those compiles over (`kept_worlds`)."""
IDLE_STEPS, IDLE_STEPS_ARTICULATED = 200, 20
"""Steps without additions and removals after which inactive bodies are deleted."""
LARGEST_PAUSE = 4
"""Largest number of steps between additions at which pooled bodies with joints are made."""
LEAST_REMOVED = 64
"""So many removed bodies may stay in MuJoCo's arrays until the next compile, more in a larger world.

Programs that remove what they added in each of their episodes would otherwise compile twice in each."""
MOST_DISCARDED = 64
"""Largest number of removed bodies that are deleted from the spec at once; a single one costs as much."""
SETTLED, MANY = 50, 32
"""Bodies in a row that were removed while they were the newest, after which more pooled bodies than so many
are replaced by the fewest: each costs time in every step."""
HISTORY_LENGTH = 12
"""Number of recent additions from which the layouts of pooled bodies are chosen: those seen twice."""
_SLOT_NAME, _REMOVED_NAME, _DISCARDED_NAME = "pooled{}", "removed{}", "discarded{}"
_FORMER_NAME = "former"

Recent = tuple[RobotDescription, BuildOptions]


class BodyPool:
    """The inactive bodies of one world."""

    def __init__(self, engine: PoolEngine) -> None:
        self._engine = engine
        self._rows = PoolRows(engine)
        self._slots: list[PooledBody] = []
        self._next = 0
        """First pooled body that may be taken; those before it have an owner or were skipped."""
        self._slot_of: dict[int, PooledBody] = {}
        """By id of the body that uses the slot."""
        self.is_used = False
        """Whether there are bodies of the pool, or removed ones, in MuJoCo's arrays."""
        self._removed: list[Built] = []
        """Elements of removed bodies in the spec."""
        self._discarded: list[Built] = []
        """Bodies that were removed and are in the spec until the next compile."""
        self._added: set[int] = set()
        """Ids of bodies added since the last compile."""
        self._mixed = False
        self._streak = 0
        self._threshold = STREAK
        self._idle = 0
        self._recent: deque[Recent] = deque(maxlen=HISTORY_LENGTH)
        self._returned: deque[bool] = deque(maxlen=HISTORY_LENGTH)
        """Of the same additions, whether the body was removed while it was the newest."""
        self._returns = 0
        """Number of bodies in a row that were."""
        self._is_trimmed = False
        """Whether the next compile gets the fewest pooled bodies, for more than was needed before."""
        self._templates = TemplateCache()
        self._steps: deque[float] = deque(maxlen=STREAK)
        """Steps before each of the last additions."""
        self._time = 0.0
        """Simulated time of the last addition (s)."""
        self._has_articulated = False
        """Whether any pooled body has joints."""
        self._acquired = 0
        """Number of bodies taken from the pool so far."""
        self.expects_bodies = False
        """Whether the next compile with new bodies gets pooled bodies in any case."""

    @property
    def free(self) -> int:
        """Number of pooled bodies that may be taken."""
        return len(self._slots) - self._next

    @property
    def inactive(self) -> int:
        """Number of inactive bodies in MuJoCo's arrays."""
        return len(self._slots) - len(self._slot_of) + len(self._removed)

    @property
    def history(self) -> tuple[Recent, ...]:
        """Recent additions, if the pool was useful, for a world that replaces this one."""
        return tuple(self._recent) if self._acquired >= STREAK else ()

    def restore_history(self, history: tuple[Recent, ...]) -> None:
        """Expect additions like those to the world that this one replaces."""
        self._recent.extend(history)
        self.expects_bodies = bool(history)

    def disable(self) -> None:
        """Compile every body that is added from now on; for measurements."""
        self._threshold = sys.maxsize

    # ------------------------------------------------------------------------------ additions and removals

    def note_added(self, body: EngineBody, options: BuildOptions | None) -> None:
        """Note a new body that needs a compile; `options` are None for a body of an MJCF file."""
        if options is not None and body.description is not None and is_poolable(body.description, options):
            self._added.add(body.id)
            self._record(body.description, options)
        else:
            self._mixed = True

    def _record(self, description: RobotDescription, options: BuildOptions) -> None:
        self._recent.append((description, options))
        self._returned.append(False)
        now = self._engine.time
        self._steps.append((now - self._time) / self._engine.timestep)
        self._time = now
        self._idle = 0

    def tick(self, steps: int) -> None:
        """Count time steps; delete inactive bodies that are not needed."""
        if self._idle > (IDLE_STEPS_ARTICULATED if self._has_articulated else IDLE_STEPS):
            self._delete_inactive()
            self._streak = 0
            self._engine.mark_stale()
        elif self._returns >= SETTLED and self.free > MANY and not self._slot_of:
            self._returns, self._is_trimmed = 0, True
            self._delete_inactive()
            self._engine.mark_stale()
        self._idle += steps

    def clear(self) -> None:
        """Delete all inactive bodies, before MuJoCo's arrays or the spec are read."""
        if self.inactive:
            if self.free and not self._slots[0].is_former:
                self._back_off()
            self._delete_inactive()
            self._engine.mark_stale()
        elif self._discarded:
            self._delete_inactive()

    def prepare(self, spec: Any) -> int:
        """Add pooled bodies to the spec before a compile; return the number of their shapes."""
        fresh, mixed = len(self._added), self._mixed
        self._added.clear()
        self._mixed = False
        if self._slots and self._slots[0].is_former:
            pass  # it was not made for others
        elif 2 * self._next < len(self._slots):
            self._back_off()
        elif self._slots:
            self._threshold = STREAK
        self._delete_inactive()
        if not self._engine.avoided_compiles:
            self._streak = self._streak + 1 if fresh and not mixed else 0
        elif not self.expects_bodies:
            self._idle = 0
            return 0
        is_first = self.expects_bodies and fresh > 0
        wanted = self._threshold
        if self._engine.is_kept and self._engine.time == 0.0:
            wanted += MORE_AT_START
        if is_first or self._is_trimmed:
            wanted = self._threshold
            self._streak, self.expects_bodies = self._threshold, False
        self._idle = 0
        if self._streak < wanted or spec.sensors or _may_sleep(spec):
            return 0
        templates = self._pooled_templates()
        if not templates:
            return 0
        self._has_articulated = any(template.description.joints for template in templates)
        fewest = FEWEST_ARTICULATED if self._has_articulated else HISTORY_LENGTH if is_first else FEWEST
        size = 0 if self._is_trimmed or self._all_return(fresh) else self._compile_cost()
        self._is_trimmed = False
        count = max(fewest, fresh, min(size, MORE + size // 2, MOST))
        for number, template in enumerate(islice(cycle(templates), count)):
            self.is_used = True
            self._slots.append(
                add_pooled_body(spec, self._engine.assets, template, _SLOT_NAME.format(number))
            )
        return sum(slot.template.counts["geom"] for slot in self._slots)

    def forgo(self) -> int:
        """Note a compile without pooled bodies, one that the world before had, too; return 0."""
        self._added.clear()
        self._mixed, self._streak, self._idle = False, 0, 0
        return 0

    def _all_return(self, fresh: int) -> bool:
        """Return whether all recent additions but the last few were removed again, the newest first.

        Their rows are free then for the next ones.
        """
        before = list(self._returned)[: len(self._returned) - fresh][1 - STREAK :]
        return len(before) == STREAK - 1 and all(before)

    def locate(self) -> None:
        """Look up the rows of pooled bodies after a compile, and make them inactive."""
        self._rows.locate(self._slots)

    def _compile_cost(self) -> int:
        """Return the cost of a compile in bodies of one link; with joints, the number of bodies."""
        bodies = self._engine.body_by_id.values()
        if self._has_articulated:
            return len(bodies)
        return sum(len(body.built.links) for body in bodies) + MESH * self._engine.assets.count

    def update_inertia(self) -> None:
        """Correct the totals of the world after inertias were written; inactive bodies do not count."""
        self._rows.update_inertia()

    def template_of(self, plan: PlannedBody, numbers: Numbers) -> BodyTemplate | None:
        """Return the template of a planned body with these numbers; None where MuJoCo rejects it."""
        return self._templates.of_numbers(numbers, plan.description, plan.options)

    def _pooled_templates(self) -> list[BodyTemplate]:
        """Return the templates of the last additions whose layout was seen at least twice."""
        is_frequent = max(self._steps) < LARGEST_PAUSE + 0.5
        jointed = [description for description, _ in self._recent if description.joints]
        recent = ((d, o) for d, o in self._recent if not d.joints or (is_frequent and jointed.count(d) > 1))
        found = [self._templates.find(description, options) for description, options in recent]
        has = self._engine.assets.has  # meshes of removed bodies may be deleted
        there = (m for m in found if m is not None and (m.description.joints or all(map(has, m.meshes))))
        templates = [template.family for template in there]
        seen = Counter(template.layout for template in templates)
        return [template for template in templates if seen[template.layout] > 1]

    def _delete_inactive(self) -> None:
        """Delete all inactive bodies from the spec at once: a single one costs as much."""
        going = [slot for slot in self._slots if slot.owner < 0]
        elements = [slot.element for slot in going]
        meshes = [mesh for slot in going for mesh in slot.template.meshes]
        removed = self._removed + self._discarded
        self._slots, self._next, self._slot_of, self._removed, self._discarded = [], 0, {}, [], []
        self.is_used = False
        self._has_articulated = False
        self._delete(removed, elements, meshes)

    def _delete(self, removed: list[Built], elements: list[Any], meshes: list[str]) -> None:
        """Delete bodies of one link from the spec, and further elements with their meshes."""
        elements += [built.links[0].element for built in removed]
        meshes += [mesh for built in removed for mesh in built.links[0].meshes]
        if not elements:
            return
        spec = self._engine.raw_spec
        frame = spec.worldbody.add_frame()
        for element in elements:
            element.set_frame(frame)
        spec.delete(frame)
        for mesh in meshes:
            self._engine.assets.release(mesh)

    def discard(self, built: Built) -> None:
        """Delete a removed body from the spec: one of one link with others, before the next compile.

        The caller marks the world stale.
        """
        if not is_plain(built):
            discard(built, self._engine.raw_spec, self._engine.assets)
            return
        if len(self._discarded) == MOST_DISCARDED:
            going, self._discarded = self._discarded, []
            self._delete(going, [], [])
        name = _DISCARDED_NAME.format(len(self._discarded))
        built.links[0].element.name = name
        if built.free_joint is not None:
            built.free_joint.name = name
        self._discarded.append(built)

    def _back_off(self) -> None:
        """Pooled bodies were not used: require more compiles before the next ones."""
        self._streak = 0
        self._threshold *= 2

    # ---------------------------------------------------------------------------------------------- bodies

    def acquire(
        self,
        description: RobotDescription,
        prefix: str,
        position: Array,
        quaternion: Array,
        options: BuildOptions,
    ) -> Built | None:
        """Turn a pooled body into the body of a description; return None where none fits.

        Args:
            description: of one link, or a description that was added before.
            prefix: of its names in the spec.
            position: (3,) of the root link's frame in the world frame (m).
            quaternion: (4,) x, y, z, w of the root link's frame.
            options: how it is built.

        The caller has to call `activate` next.
        """
        if self._engine.is_stale or not self.free or not is_poolable(description, options):
            return None
        if position.shape != (3,) or not all(map(isfinite, position.tolist())):
            return None  # the compile raises the error
        template = self._templates.find(description, options)
        if template is None:
            return None
        layout, slots, edits = template.layout, self._slots, self._engine.element_edits
        fitting = (
            k
            for k in range(self._next, len(slots))
            if slots[k].template.layout == layout and slots[k].is_free(edits)
        )
        found = next(fitting, None)
        if found is None:
            return None
        slot, root = slots[found], description.root
        self._rows.fill(slot, template, options, position, to_wxyz(quaternion))
        slot.rename(prefix)
        self._next = found + 1
        self._acquired += 1
        self._record(description, options)
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
        """Note the id of the body that was acquired last."""
        slot = self._slots[self._next - 1]
        slot.owner = body.id
        self._slot_of[body.id] = slot

    def forget(self, body: EngineBody) -> None:
        """Note that a body was removed."""
        self._added.discard(body.id)
        others, returned = self._engine.body_by_id, self._returned
        if not others or next(reversed(others)) < body.id:
            for place in range(len(returned) - 1, -1, -1):
                if not returned[place]:
                    returned[place] = True
                    self._returns += 1
                    return
        self._returns = 0

    def can_release(self, body: EngineBody) -> bool:
        """Return whether a body can become inactive, so that its elements stay until the next compile."""
        engine, slot = self._engine, self._slot_of.get(body.id)
        is_new = (
            slot is not None and slot.edits == engine.element_edits
        )  # nothing was added to the spec since
        if engine.is_stale or not (is_new or is_apart(body, engine.live_model)):
            return False
        built = body.built
        if engine.would_be_pile(more_dofs=0) and not engine.would_be_pile(more_dofs=-built.free_dofs):
            return False  # contacts turn hard again: their numbers are in the spec
        if slot is not None:
            return True
        if len(built.links) > 1:
            return self._former_template(body) is not None
        return len(self._removed) < max(LEAST_REMOVED, len(engine.body_by_id))

    def _former_template(self, body: EngineBody) -> BodyTemplate | None:
        """Return the template of a body of several links that the next one like it may follow in its rows.

        It is the newest, so that bodies stay in the order of their ids, and no pooled bodies come after it.
        """
        plan, bodies = body.plan_of_elements, self._engine.body_by_id
        if plan is None or self._slots or next(reversed(bodies), body.id) > body.id:
            return None
        if not is_poolable(plan.description, plan.options):
            return None
        return self._templates.find(plan.description, plan.options)

    def release(self, body: EngineBody) -> None:
        """Make a removed body inactive, which `can_release`."""
        slot, built = self._slot_of.pop(body.id, None), body.built
        self._idle = 0
        if slot is None and len(built.links) > 1:
            template = self._former_template(body)
            assert template is not None
            slot = self._rows.former(built, template, _FORMER_NAME)
            self._slots, self._next = [slot], 1
            self.is_used = self._has_articulated = True
        if slot is None:
            self._rows.deactivate_body(built, _REMOVED_NAME.format(len(self._removed)))
            self._removed.append(built)
            self.is_used = True
            return
        self._rows.deactivate(slot)
        edits = self._engine.element_edits
        while self._next and self._slots[self._next - 1].is_free(edits):
            self._next -= 1


def _may_sleep(spec: Any) -> bool:
    return bool(spec.option.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP))

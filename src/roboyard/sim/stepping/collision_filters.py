"""Collision filters: self-collision and groups by bit masks, single pairs by exclusion."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.sim.body import Body
from roboyard.sim.build.group_masks import code_masks
from roboyard.sim.build.masks import ALL_MASKS
from roboyard.sim.engine import Engine
from roboyard.sim.link import Link
from roboyard.sim.link_groups import GroupChange, Key, LinkGroups, in_order


class CollisionFilters:
    """Keeps the exclusions of a world in its spec.

    MuJoCo lets two geoms touch if a bit of one's `contype` is in the other's `conaffinity`. A robot without
    self-collision owns a code, a set of bits: its geoms have the code as contype and all other bits as
    conaffinity. So they do not collide with one another, but with all others: of two different sets, one is
    not within the other, in either direction. Links with a group have other bits; see `LinkGroups`.

    An exclusion that ends leaves its row in MuJoCo's arrays to the next one, without a compile.
    """

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._free_codes: list[int] = []
        """Codes of removed robots, in order."""
        self._codes = 0
        """Number of codes in use or free."""
        self._excluded: set[Key] = set()
        """All pairs that need an exclusion."""
        self._disabled: set[Key] = set()
        """Those that do not collide, with any groups."""
        self._by_groups: set[Key] = set()
        """Those that do not collide for their groups."""
        self._elements: dict[Key, Any] = {}
        self._live: tuple[Any, list[int], dict[Key, int]] | None = None
        """The MjModel whose exclusions were written last, those of its exclusions that are of files, and
        MuJoCo's numbers of pairs."""
        self._owned: dict[int, int] = {}
        self._next: int | None = None
        self._groups = LinkGroups(world.body_by_id, self._owned)

    def masks(self, description: RobotDescription, self_collision: bool) -> tuple[int, int]:
        """Return contype and conaffinity for the geoms of the body that is added next."""
        self._next = None
        parts = sum(bool(link.collisions) for link in description.links)
        if self_collision or parts < 2:
            return 1, ALL_MASKS
        self._next = self._free_codes[0] if self._free_codes else self._codes
        return code_masks(self._next)

    def set(self, a: Link, b: Link, *, collide: bool) -> None:
        """Let two links collide in spite of their groups, or not."""
        one, other = (a.body.id, a.index), (b.body.id, b.index)
        pair = {in_order(one, other)}
        if collide:
            self._disabled -= pair
        else:
            self._disabled |= pair
        self._apply(self._groups.enable(one, other, collide=collide), pair)

    def set_group(self, link: Link, group: int, mask: int) -> None:
        """Let a link collide with those links whose group or mask shares a bit with its mask or group.

        Links have group 1 and all bits in the mask until this is called. Shapes of MJCF files keep their own
        masks.

        Args:
            link: the link.
            group: bits.
            mask: bits.
        """
        self._apply(self._groups.set((link.body.id, link.index), (group, mask)))

    def collides(self, a: Link, b: Link) -> bool:
        """Return whether a pair is not disabled, without regard to the groups of both."""
        return in_order((a.body.id, a.index), (b.body.id, b.index)) not in self._disabled

    def _apply(self, change: GroupChange, pairs: Iterable[Key] = ()) -> None:
        """Exclude pairs by a change of groups, and these pairs as they were disabled or enabled."""
        self._by_groups -= change.removed
        self._by_groups |= change.added
        changed = {*change.added, *change.removed, *pairs}
        wanted = {key for key in changed if key in self._disabled or key in self._by_groups}
        if wanted != changed & self._excluded:
            self._replace(changed - wanted, wanted)
        if change.links and not self._world.is_stale:
            self._groups.write(self._world.live_model, change.links)

    def _replace(self, removed: set[Key], added: set[Key]) -> None:
        """Replace exclusions, in MuJoCo's arrays where these have rows enough for them."""
        world = self._world
        known = not world.is_stale and self._look_up()
        self._excluded -= removed
        self._excluded |= added
        if not known or not self._write_live():
            world.mark_stale(grows=True)

    def write_groups(self) -> None:
        """Write the masks of groups into the arrays of a compiled model."""
        if self._groups:
            self._groups.write(self._world.live_model)

    def _look_up(self) -> bool:
        """Look up the exclusions of files, while all others are known; return whether there are any rows."""
        model = self._world.live_model
        if not model.nexclude:
            return False
        if self._live is None or self._live[0] is not model:
            self._live = model, [], {}
            others = Counter(model.exclude_signature.tolist())
            others.subtract(map(self._signature, self._excluded))
            self._live[1].extend(others.elements())
        return True

    def _write_live(self) -> bool:
        """Write all exclusions into MuJoCo's arrays; return False where they have too few rows."""
        assert self._live is not None
        model, others, _ = self._live
        signatures = others + [self._signature(key) for key in self._excluded]
        unused = model.nexclude - len(signatures)
        if unused < 0:
            return False
        model.exclude_signature[:] = [*([0] * unused), *sorted(signatures)]  # MuJoCo needs them in order
        return True

    def _signature(self, key: Key) -> int:
        """Return MuJoCo's number of a pair of bodies."""
        assert self._live is not None
        known = self._live[2]
        if key not in known:
            bodies = self._world.body_by_id
            one, two = (int(bodies[body].built.links[link].element.id) for body, link in key)
            known[key] = (min(one, two) << 16) + max(one, two)
        return known[key]

    def assign_masks(self, body: Body) -> None:
        """Assign the masks returned last to the body that was added."""
        if self._next is not None:
            self._owned[body.id] = self._next
            if self._free_codes:
                self._free_codes.pop(0)
            else:
                self._codes += 1
        self._next = None
        if self._groups:
            self._apply(GroupChange(added=self._groups.add(body)))

    def forget(self, body: Body) -> None:
        """Free the code of a body that is removed, and delete its group and exclusions."""
        self._groups.forget(body)
        code = self._owned.pop(body.id, None)
        if code is not None:
            self._free_codes.append(code)
            self._free_codes.sort()
        kept = {key for key in self._excluded if body.id not in (key[0][0], key[1][0])}
        leaves_rows = True
        if len(kept) < len(self._excluded):
            known = not self._world.is_stale and self._look_up()
            self._excluded = kept
            self._disabled &= kept
            self._by_groups &= kept
            leaves_rows = known and self._write_live()
        self._delete_elements(leaves_rows=leaves_rows)

    def _delete_elements(self, *, leaves_rows: bool) -> None:
        """Delete elements that no longer hold from the spec, before those of their bodies.

        leaves_rows: whether their rows in MuJoCo's arrays remain without effect, for other pairs.
        """
        gone = [key for key in self._elements if key not in self._excluded]
        for key in gone:
            self._world.raw_spec.delete(self._elements.pop(key))
        if gone:
            self._world.note_edit()
            if not leaves_rows:
                self._world.mark_stale()

    def write(self) -> None:
        """Update the spec's exclusions, before each compile."""
        self._sync()

    def complete_spec(self) -> None:
        """Update the spec's exclusions before the spec or MuJoCo's arrays are read."""
        if self._elements.keys() != self._excluded:
            self._sync()
            self._world.mark_stale()

    def complete_masks(self) -> None:
        """Write the masks of groups into the spec before it is read."""
        if self._groups and self._groups.write_spec():
            self._world.mark_stale()

    def key(self) -> frozenset[Key]:
        """Return the pairs that the next compile excludes, by the bodies' places in the world."""
        return frozenset(self._by_place(self._excluded))

    def elements(self) -> dict[Key, Any]:
        """Return the spec's exclusions, by the bodies' places in the world."""
        return self._by_place(self._elements)

    def take(self, elements: dict[Key, Any]) -> None:
        """Take over what `elements` returned of a world with an equal key."""
        places = self._by_place(self._excluded)
        self._elements = {key: elements[place] for place, key in places.items()}

    def leave(self) -> None:
        """Note that the spec is another one, without exclusions yet."""
        self._elements = {}

    def _by_place(self, keys: Mapping[Key, Any] | set[Key]) -> dict[Key, Any]:
        """Return keys with places in the world instead of ids of bodies, and what each is of."""
        if not keys:
            return {}
        place = {body: k for k, body in enumerate(self._world.body_by_id)}
        found = keys if isinstance(keys, Mapping) else {key: key for key in keys}
        return {((place[a], i), (place[b], j)): value for ((a, i), (b, j)), value in found.items()}

    def _sync(self) -> None:
        if self._elements.keys() == self._excluded:
            return
        bodies, spec = self._world.body_by_id, self._world.raw_spec
        self._delete_elements(leaves_rows=False)
        for key in self._excluded - self._elements.keys():
            (body_a, link_a), (body_b, link_b) = key
            self._elements[key] = spec.add_exclude(
                bodyname1=bodies[body_a].built.links[link_a].element.name,
                bodyname2=bodies[body_b].built.links[link_b].element.name,
            )

"""Panel of pairs of links whose collisions are disabled, in the simulation and for the planner."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from roboyard.errors import ConfigError
from roboyard.viewer.inspector.edits.edit_state import EditState, Pair, pair
from roboyard.viewer.page.callbacks import carried_out_by, in_order

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link

NONE = "(none)"
BETWEEN = " + "


class PairPanel:
    """A list of pairs, two boxes for the selected one, and buttons to add more."""

    def __init__(
        self,
        gui: Any,
        body: Body,
        edits: EditState,
        do: Callable[[Callable[[], None]], None],
        highlight: Callable[[Link | None], None],
        touching: Callable[[], list[tuple[str, str, float]]],
    ) -> None:
        """Add the panel's elements.

        Args:
            gui: panel of the page.
            body: the robot.
            edits: edits of the robot.
            do: queues a request for the simulation thread.
            highlight: highlights a link.
            touching: returns the pairs that overlap in the current posture, with their depth (m).
        """
        self._body, self._edits, self._do = body, edits, do
        self._highlight, self._touching = highlight, touching
        self.message = gui.add_markdown("")
        self.choice = gui.add_dropdown("pair", (NONE,), initial_value=NONE)
        self.physics_box = gui.add_checkbox("no collision in the simulation", False)
        self.planner_box = gui.add_checkbox("not checked by the planner", False)
        links = tuple(link.name for link in body.links)
        with gui.add_folder("Another"):
            self.first = gui.add_dropdown("link", links)
            self.second = gui.add_dropdown("and link", links, initial_value=links[-1])
            self.add_button = gui.add_button("Add the pair")
            self.touching_button = gui.add_button(
                "Add overlapping pairs", hint="those of the current posture"
            )

        by_user = carried_out_by(self._do)
        self.choice.on_update(by_user(lambda: self.pick(self._chosen())))
        self.physics_box.on_update(by_user(self._ticked))
        self.planner_box.on_update(by_user(self._ticked))
        self.add_button.on_click(
            in_order(
                lambda _: self._do(lambda: self.add([pair(str(self.first.value), str(self.second.value))]))
            )
        )
        self.touching_button.on_click(in_order(lambda _: self._do(self.add_touching)))
        self.picked: Pair | None = None
        self._added: list[Pair] = []
        self.refresh()

    def _pairs(self) -> list[Pair]:
        """Return the listed pairs, including those unticked since the page was opened."""
        return sorted(self._edits.physics_pairs | self._edits.planner_pairs | set(self._added))

    def _chosen(self) -> Pair | None:
        return next((one for one in self._pairs() if BETWEEN.join(one) == self.choice.value), None)

    def refresh(self) -> None:
        """Update the list."""
        pairs = self._pairs()
        self.choice.options = tuple(BETWEEN.join(one) for one in pairs) or (NONE,)
        if self.picked not in pairs:
            self.picked = pairs[0] if pairs else None
        self.message.content = (
            f"**{len(self._edits.physics_pairs)} pairs do not collide in the simulation, "
            f"{len(self._edits.planner_pairs)} are not checked by the planner.**"
        )
        self._show()

    def pick(self, one: Pair | None) -> None:
        """Select a pair and highlight its first link."""
        self.picked = one
        self._show()
        link = None if one is None else next((k for k in self._body.links if k.name == one[0]), None)
        self._highlight(link)

    def _show(self) -> None:
        one = self.picked
        self.choice.value = NONE if one is None else BETWEEN.join(one)
        self.physics_box.value = one in self._edits.physics_pairs
        self.planner_box.value = one in self._edits.planner_pairs

    def _ticked(self) -> None:
        if self.picked is None:
            return
        self._added.append(self.picked)  # it stays in the list until the page is loaded again
        for box, pairs in (
            (self.physics_box, self._edits.physics_pairs),
            (self.planner_box, self._edits.planner_pairs),
        ):
            (pairs.add if box.value else pairs.discard)(self.picked)
        self.refresh()

    def add(self, pairs: list[Pair]) -> None:
        """Disable collisions of pairs, in the simulation and for the planner.

        Raises:
            ConfigError: a pair has the same link twice.
        """
        for a, b in pairs:
            if a == b:
                raise ConfigError(f"a pair needs two links, got {a!r} twice; choose another second link")
        self._edits.physics_pairs.update(pairs)
        self._edits.planner_pairs.update(pairs)
        if pairs:
            self.picked = pairs[-1]
        self.refresh()

    def add_touching(self) -> None:
        """Disable collisions of all pairs that overlap in the current posture."""
        found = [pair(a, b) for a, b, _ in self._touching()]
        self.add(found)
        self.message.content += f" {len(found)} pairs overlap now."

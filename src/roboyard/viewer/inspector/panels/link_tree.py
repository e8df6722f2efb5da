"""The tree of links on the page: a button for each layer, and sliders for the opacity of the selected one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.viewer.inspector.layers.link_layer import LinkLayer
from roboyard.viewer.inspector.panels.findings import findings_of
from roboyard.viewer.page.page_script import PageScript

if TYPE_CHECKING:
    from roboyard.audit import Audit
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link

Kept = dict[str, tuple[frozenset[str], dict[str, float]]]
"""Label of a layer to the names of its shown links, and to their opacities."""


class LinkTree:
    """Shows all links, and which layers of each are shown; a click selects, shows or fades.

    Buttons of the head row show or hide a layer of all links.
    """

    def __init__(
        self,
        server: Any,
        body: Body,
        audit: Audit | None,
        layers: Mapping[str, LinkLayer],
        do: Callable[[Callable[[], None]], None],
        pick: Callable[[Link | None], None],
        on_change: Callable[[], None],
    ) -> None:
        """Add the tree to the current folder of the panel.

        Args:
            server: a `viser.ViserServer`.
            body: the robot.
            audit: findings of its file; links with errors and warnings have a colour.
            layers: label to layer, in the order of the buttons.
            do: queues a request for the simulation thread.
            pick: selects a link; None: no link.
            on_change: called in the simulation thread after a layer was changed here.
        """
        self._body, self._do = body, do
        self.layers = dict(layers)
        """Label to layer, in the order of the buttons."""
        self._pick, self._on_change = pick, on_change
        self._children: list[list[int]] = [[] for _ in body.links]
        for link in body.links:
            if link.parent is not None:
                self._children[link.parent.index].append(link.index)
        self._links = _described(body, audit)
        self.picked: Link | None = None
        """The selected link."""
        self._sent: Any = None
        server.gui.add_html("<div data-roboyard-tree></div>")
        source = (Path(__file__).parent / "link_tree.js").read_text(encoding="utf-8")
        self._script = PageScript(server, "link tree", source, self._on_message)
        self.update()

    def update(self) -> None:
        """Send the current state to the pages, if it changed."""
        names = [link.name for link in self._body.links]
        has = [[k for k, name in enumerate(names) if layer.has(name)] for layer in self.layers.values()]
        state = {
            "title": f"{len(names)} links, {self._body.mass:.4g} kg",
            "layers": list(self.layers),
            "links": self._links,
            "has": has,
            "shown": [
                [k for k in some if names[k] in layer.shown]
                for some, layer in zip(has, self.layers.values(), strict=True)
            ],
            "opacity": [
                [round(layer.opacity_of(name), 3) for name in names] for layer in self.layers.values()
            ],
            "picked": -1 if self.picked is None else self.picked.index,
        }
        if state != self._sent:
            self._sent = state
            self._script.send(state)

    def _below(self, index: int) -> list[int]:
        """Return a link and all links below it."""
        found = [index]
        for one in found:
            found += self._children[one]
        return found

    def _on_message(self, client: int, value: Any) -> None:
        del client
        count = len(self._body.links)
        match value:
            case ["pick", int(index)] if -1 <= index < count:
                link = None if index < 0 else self._body.links[index]
                self._do(lambda: self._pick(link))
            case ["show", int(layer), int(index), bool(on), bool(below)] if (
                0 <= layer < len(self.layers) and -1 <= index < count
            ):
                self._do(lambda: self.show(layer, index, on, below=below))
            case ["fade", int(layer), int(index), int() | float() as opacity, bool(below)] if (
                0 <= layer < len(self.layers) and 0 <= index < count and math.isfinite(opacity)
            ):
                self._do(lambda: self.fade(layer, index, float(opacity), below=below))
            case _:
                pass

    def show(self, layer: int, index: int, on: bool, *, below: bool = False) -> None:
        """Show or hide a layer of a link, or also of all links below it; index -1: of all links."""
        shown = list(self.layers.values())[layer]
        if index < 0:
            shown.show(on)
        else:
            for one in self._below(index) if below else [index]:
                shown.show_link(self._body.links[one].name, on)
        self._on_change()

    def fade(self, layer: int, index: int, opacity: float, *, below: bool = False) -> None:
        """Set the opacity of a layer of a link, or also of all links below it; at most 1."""
        faded = list(self.layers.values())[layer]
        for one in self._below(index) if below else [index]:
            faded.fade(self._body.links[one].name, opacity)
        self._on_change()

    def kept(self) -> Kept:
        """Return what is shown, for the tree of the same robot loaded again."""
        names = [link.name for link in self._body.links]
        return {
            label: (frozenset(layer.shown), {name: layer.opacity_of(name) for name in names})
            for label, layer in self.layers.items()
        }

    def keep(self, kept: Kept) -> None:
        """Show what another tree showed; links that it did not have are shown with all others."""
        for label, (shown, opacities) in kept.items():
            layer = self.layers[label]
            for link in self._body.links:
                layer.fade(link.name, opacities.get(link.name, layer.opacity_of(link.name)))
                known = link.name in opacities
                layer.show_link(link.name, link.name in shown if known else shown == opacities.keys())
        self._on_change()

    def remove(self) -> None:
        """Stop receiving messages."""
        self._script.remove()


def _described(body: Body, audit: Audit | None) -> list[dict[str, Any]]:
    """Return name, parent, depth, mass and the worst finding of each link."""
    described: list[dict[str, Any]] = []
    for link in body.links:
        depth, parent = 0, link.parent
        while parent is not None:
            depth, parent = depth + 1, parent.parent
        severities = [finding.severity for finding in findings_of(body, link, audit)]
        worst = min(severities).label if severities else ""
        described.append(
            {
                "name": link.name,
                "parent": -1 if link.parent is None else link.parent.index,
                "depth": depth,
                "mass": f"{link.mass:.3g} kg" if link.mass > 0 else "",
                "found": worst if worst in ("error", "warning") else "",
            }
        )
    return described

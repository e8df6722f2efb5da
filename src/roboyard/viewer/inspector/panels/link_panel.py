"""The tree of links, and the properties of the selected one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.viewer.inspector.layers.link_layer import LinkLayer
from roboyard.viewer.inspector.panels.findings import finding_line, findings_of
from roboyard.viewer.inspector.panels.link_tree import LinkTree
from roboyard.viewer.page.markdown import plain

if TYPE_CHECKING:
    from roboyard.audit import Audit
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link


class LinkPanel:
    """The tree of links, with the properties and findings of the selected one below it."""

    def __init__(
        self,
        server: Any,
        body: Body,
        audit: Audit | None,
        layers: Mapping[str, LinkLayer],
        do: Callable[[Callable[[], None]], None],
        on_pick: Callable[[Link | None], None],
        on_change: Callable[[], None],
    ) -> None:
        """Add the panel's elements; `on_pick` receives each selected link. See `LinkTree` for the others."""
        self._body, self._audit, self._on_pick = body, audit, on_pick
        self.tree = LinkTree(server, body, audit, layers, do, self.pick, on_change)
        self.facts = server.gui.add_markdown("")

    @property
    def picked(self) -> Link | None:
        """The selected link."""
        return self.tree.picked

    def pick(self, link: Link | None) -> None:
        """Select a link and show its properties; None: no link."""
        self.tree.picked = link
        self.tree.update()
        self.facts.content = "" if link is None else self._facts_of(link)
        self._on_pick(link)

    def _facts_of(self, link: Link) -> str:
        joint = self._body.joint_of(link)
        lines = [f"**{plain(link.name)}**", ""]
        if joint is not None:
            lines.append(f"- on {plain(joint.parent.name)} by {joint.type} joint {plain(joint.name)}")
        else:
            lines.append("- the root")
        description = self._body.description
        source = None if description is None else description.link_by_name.get(link.name)
        if source is not None:
            lines.append(f"- {len(source.visuals)} visual and {len(source.collisions)} collision shapes")
        if link.mass > 0:
            model = self._body.world.model
            row = link.mujoco_id
            lines.append(f"- {link.mass:.4g} kg at {_numbers(model.body_ipos[row])} m")
            lines.append(f"- principal moments {_numbers(model.body_inertia[row])} kg m²")
        else:
            lines.append("- no mass")
        lines += [finding_line(finding) for finding in findings_of(self._body, link, self._audit)]
        return "\n".join(lines)


def _numbers(values: Any) -> str:
    return "(" + ", ".join(f"{float(v):.4g}" for v in np.asarray(values)) + ")"

"""The tree of links with their masses, and the findings of the audit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.viewer.page.markdown import plain

if TYPE_CHECKING:
    from roboyard.audit import Audit, Finding
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link

NOTHING = "(none selected)"
INDENT = "\u2003"
MAX_SHOWN = 40
"""Findings listed on the page; further ones are counted."""


class LinkPanel:
    """A list of links, with the properties and findings of the selected one."""

    def __init__(
        self, gui: Any, body: Body, audit: Audit | None, on_pick: Callable[[Link | None], None]
    ) -> None:
        self._body = body
        self._findings: Sequence[Finding] = () if audit is None else audit.findings
        self._on_pick = on_pick
        self._labels = {label: link for link, label in zip(body.links, tree_labels(body), strict=True)}
        self._label_of = {link.index: label for label, link in self._labels.items()}
        gui.add_markdown(f"**{len(body.links)} links, {body.mass:.4g} kg.** Select one here or on the robot.")
        self.choice = gui.add_dropdown("link", [NOTHING, *self._labels], initial_value=NOTHING)
        self.facts = gui.add_markdown("")

        @self.choice.on_update
        def _(event: Any) -> None:
            if event.client_id is not None:
                self.pick(self._labels.get(event.target.value))

    def pick(self, link: Link | None) -> None:
        """Select a link and show its properties; None: no link."""
        self.choice.value = NOTHING if link is None else self._label_of[link.index]
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
        names = {f'link "{link.name}"'} | ({f'joint "{joint.name}"'} if joint is not None else set())
        lines += [finding_line(finding) for finding in self._findings if about(finding, names)]
        return "\n".join(lines)


def tree_labels(body: Body) -> list[str]:
    """Return a unique label of each link, indented by its depth, with its mass."""
    labels: list[str] = []
    for link in body.links:
        depth, parent = 0, link.parent
        while parent is not None:
            depth, parent = depth + 1, parent.parent
        mass = f" · {link.mass:.3g} kg" if link.mass > 0 else ""
        labels.append(f"{INDENT * min(depth, 8)}{link.name}{mass}")
    return labels


def findings_text(audit: Audit | None) -> str:
    """Format an audit as Markdown, errors first."""
    if audit is None:
        return "No file to audit."
    if not audit.findings:
        return "**OK.** The audit found nothing."
    lines = [f"**{audit.status.capitalize()}**: {len(audit.findings)} findings."]
    severity = None
    for finding in audit.findings[:MAX_SHOWN]:
        if finding.severity != severity:
            severity = finding.severity
            lines += ["", f"**{severity.label.capitalize()}**", ""]
        lines.append(finding_line(finding))
    if len(audit.findings) > MAX_SHOWN:
        lines += ["", f"... and {len(audit.findings) - MAX_SHOWN} more; `roboyard audit` lists them."]
    return "\n".join(lines)


def finding_line(finding: Finding) -> str:
    """Format a finding as an item of a Markdown list."""
    who = f"{plain(finding.element)}: " if finding.element else ""
    where = f" (line {finding.line})" if finding.line is not None else ""
    return f"- {who}{plain(finding.message)}{where}; *{plain(finding.remedy)}*"


def about(finding: Finding, names: set[str]) -> bool:
    """Return whether a finding is about one of the elements, as in `link "elbow"`."""
    return any(finding.element == name or finding.element.startswith(name) for name in names)


def _numbers(values: Any) -> str:
    return "(" + ", ".join(f"{float(v):.4g}" for v in np.asarray(values)) + ")"

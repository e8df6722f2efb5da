"""Table of what an import understood about a robot, with reasons, for its report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from roboyard.importer.config.write import THIN
from roboyard.reports.html import table

MAX_SHOWN = 12
"""Most names of one conclusion that are shown."""


def conclusion_table(facts: Mapping[str, Any]) -> list[str]:
    """Return a table of the conclusions among the facts of an import's log; empty without any.

    Each has its confidence, its evidence and the line of configuration that changes it; the least certain
    ones are first.
    """
    found: Sequence[Mapping[str, Any]] = facts.get("conclusions", [])
    if not found:
        return []
    rows = [
        (
            str(one["field"]).replace("_", " ").replace(".", " "),
            _shown(one["value"]),
            "as configured" if one["confidence"] >= 1.0 else f"{100 * one['confidence']:.0f} %",
            "; ".join(one["evidence"]),
            one["setting"],
        )
        for one in sorted(found, key=lambda one: one["confidence"] >= THIN)
    ]
    thin = sum(one["confidence"] < THIN for one in found)
    note = f"<p>Please check the first {thin}: the evidence is thin.</p>" if thin else ""
    heads = ("what", "value", "confidence", "evidence", "the line that changes it")
    return ["<h2>What the robot is understood to be</h2>", note, table(heads, rows)]


def _shown(value: Any) -> str:
    if not isinstance(value, list):
        return str(value)
    more = f" and {len(value) - MAX_SHOWN} more" if len(value) > MAX_SHOWN else ""
    return (", ".join(map(str, value[:MAX_SHOWN])) or "none") + more

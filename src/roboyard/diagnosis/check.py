"""The result of one check of an installation."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

Status = Literal["ok", "missing", "slow", "failed"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Check:
    """One result, with its remedy."""

    name: str
    status: Status
    """"missing": optional and not there; "slow": works, but takes longer than it has to; "failed": a command
    of Roboyard will fail.
    """
    detail: str
    """Findings, with figures."""
    remedy: str = ""
    """What to do about it; empty where nothing has to be done."""

    def to_json(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return asdict(self)

"""An interactive flat: rooms, doors and drawers that open, furniture and household objects."""

from __future__ import annotations

from roboyard.scenes.flat.plan import home

__all__ = ["home"]

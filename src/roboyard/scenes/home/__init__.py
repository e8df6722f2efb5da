"""An interactive flat: rooms, doors and drawers that open, furniture and household objects."""

from __future__ import annotations

from roboyard.scenes.home.flat import home

__all__ = ["home"]

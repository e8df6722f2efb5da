"""Pictures and scans of many environments, and how environments look: colours, lights, camera poses."""

from __future__ import annotations

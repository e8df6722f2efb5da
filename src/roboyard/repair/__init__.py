"""Repair a robot description: fix the findings that have one safe fix, in a copy.

`repair_urdf(path, out)` makes every fix in a fixed order (`FIXES`), logs each with before and after, and
writes the repaired robot into its own folder. A new fix is one small function in `fixes/`; see `registry`.
"""

from roboyard.repair.registry import FIXES
from roboyard.repair.run import Fix, Repair, repair_urdf

__all__ = ["FIXES", "Fix", "Repair", "repair_urdf"]

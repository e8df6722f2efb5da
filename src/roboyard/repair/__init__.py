"""Mend a robot description.

`repair_urdf(path, out)` does every mend in a stated order (`FIXES`), logs each with before and after, and
writes a
clean robot into its own folder. A new mend is one small function in `mends/`; see `registry`.
"""

from roboyard.repair.registry import FIXES
from roboyard.repair.run import Fix, Repair, repair_urdf

__all__ = ["FIXES", "Fix", "Repair", "repair_urdf"]

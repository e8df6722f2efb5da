"""Mend a robot description.

`repair(path, out)` does every mend in a stated order (`MENDS`), logs each with before and after, and writes a
clean robot into its own folder. A new mend is one small function in `mends/`; see `registry`.
"""

from roboyard.repair.registry import MENDS
from roboyard.repair.run import Mend, Repair, repair

__all__ = ["MENDS", "Mend", "Repair", "repair"]

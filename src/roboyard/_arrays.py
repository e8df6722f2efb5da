"""The types of arrays for annotations and aliases, as `numpy.typing` has them.

That module formats the texts of its aliases when it is imported, which takes 0.002 s.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
else:
    try:
        from numpy._typing import ArrayLike, NDArray
    except ImportError:  # its place is no public one
        from numpy.typing import ArrayLike, NDArray

__all__ = ["ArrayLike", "NDArray"]

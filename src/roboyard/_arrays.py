"""The types of arrays for annotations and aliases, as `numpy.typing` has them.

To import that module takes as long as forty of this package's; nothing asks for them while a program runs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
else:

    class ArrayLike:
        """The name of `numpy.typing.ArrayLike`: values of which NumPy makes an array."""

    class NDArray:
        """The name of `numpy.typing.NDArray`."""

        def __class_getitem__(cls, kind: Any) -> Any:
            """Return the type of arrays of a kind."""
            return np.ndarray[Any, np.dtype[kind]]


__all__ = ["ArrayLike", "NDArray"]

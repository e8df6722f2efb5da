"""One handle in the scene for the edited object."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.transforms import IDENTITY_QUATERNION, Array, from_wxyz, to_wxyz

if TYPE_CHECKING:
    from roboyard.viewer.viewer import Viewer

OnMove = Callable[[Array, Array], None]
"""Called with position (3,) (m) and quaternion (4,) x, y, z, w in the link frame."""


class Gizmo:
    """Transform controls for one object in a link frame at a time."""

    def __init__(self, viewer: Viewer, do: Callable[[Callable[[], None]], None], size: float) -> None:
        """Start without a handle; `do` queues a request for the simulation thread, `size` is in m."""
        self._viewer, self._do, self._size = viewer, do, size
        self.handle: Any = None

    def hold(
        self,
        path: str,
        position: Any,
        quaternion: Any = IDENTITY_QUATERNION,
        *,
        on_move: OnMove,
        turns: bool = True,
    ) -> None:
        """Show the handle at a pose below the node at `path`; `on_move` is called when it is dragged."""
        self.release()
        handle = self._viewer.server.scene.add_transform_controls(
            f"{path}/handle",
            scale=self._size,
            disable_rotations=not turns,
            depth_test=False,
            position=np.asarray(position, dtype=float),
            wxyz=to_wxyz(np.asarray(quaternion, dtype=float)),
        )

        async def moved(_: Any) -> None:
            place, turn = np.array(handle.position), from_wxyz(np.array(handle.wxyz))
            self._do(lambda: on_move(place, turn) if self.handle is handle else None)

        handle.on_update(moved)
        self.handle = handle

    def put(self, position: Any, quaternion: Any = IDENTITY_QUATERNION) -> None:
        """Move the handle without a call of `on_move`."""
        if self.handle is not None:
            self.handle.position = np.asarray(position, dtype=float)
            self.handle.wxyz = to_wxyz(np.asarray(quaternion, dtype=float))

    def release(self) -> None:
        """Remove the handle."""
        if self.handle is not None:
            self.handle.remove()
            self.handle = None

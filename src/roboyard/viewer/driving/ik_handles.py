"""Handles on a robot's end effectors: drag one, and the arm follows by inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix, to_wxyz

if TYPE_CHECKING:
    from roboyard.viewer.driving.action_source import ActionSource
    from roboyard.viewer.viewer import Viewer

SCALE = 0.22
"""Size of a handle (m)."""


class IkHandles:
    """One handle for each arm with a task-space controller, attached to the robot's base.

    A handle follows its end effector until it is dragged; from then on the end effector follows the handle,
    or `on_release` is called when the handle is let go.
    """

    def __init__(self, viewer: Viewer, action_source: ActionSource) -> None:
        """Add the handles; call it from the simulation thread."""
        self.on_release: Callable[[str, Array], None] | None = None
        """Is given joint group and (4, 4) pose in the base frame; called in the server's thread. Drags set no
        targets while there is one."""
        self._action_source = action_source
        base = viewer.path_of(action_source.robot.base_link)
        self.handles: dict[str, Any] = {}
        """Joint group to its viser transform controls."""
        self._dragged: set[str] = set()
        for group in action_source.arms:
            position_only = action_source.robot.controllers[group].command_dim < 6
            handle = viewer.server.scene.add_transform_controls(
                f"{base}/handle of {group}",
                scale=SCALE,
                line_width=3.0,
                disable_rotations=position_only,
                depth_test=False,
                opacity=0.85,
            )
            handle.on_update(self._listener(group, handle))
            self.handles[group] = handle
        self.follow()

    def _listener(self, group: str, handle: Any) -> Any:
        async def on_update(event: Any) -> None:
            # in the server's event loop, so that the phases come in order; no more than two assignments
            if event.phase != "end":
                self._dragged.add(group)
            if self.on_release is None:
                self._action_source.targets[group] = _pose(handle)
            elif event.phase == "end":
                self.on_release(group, _pose(handle))  # the handle stays until `let_go`
                return
            if event.phase == "end":
                self._dragged.discard(group)

        return on_update

    def show(self, visible: bool) -> None:
        """Show or hide all handles; a hidden handle sets no target."""
        for handle in self.handles.values():
            handle.visible = visible
        if not visible:
            self.release()

    def let_go(self, group: str) -> None:
        """Let a handle that was released follow its end effector again."""
        self._dragged.discard(group)

    def release(self) -> None:
        """Drop all targets and move the handles back to their end effectors."""
        self._dragged.clear()
        for group in self.handles:
            self._action_source.targets.pop(group, None)
        self.follow()

    def follow(self) -> None:
        """Move handles without a target to their end effectors; call it from the simulation thread."""
        for group, handle in self.handles.items():
            if group in self._dragged or group in self._action_source.targets or not handle.visible:
                continue
            pose = self._action_source.end_effector_pose(group)
            if not np.allclose(_pose(handle), pose, atol=1e-4):
                handle.position = pose[:3, 3]
                handle.wxyz = to_wxyz(quaternion_from_matrix(pose[:3, :3]))

    def remove(self) -> None:
        """Remove the handles from the scene."""
        for handle in self.handles.values():
            handle.remove()
        self.handles.clear()


def _pose(handle: Any) -> Array:
    """Return the (4, 4) pose of a handle in the robot's base frame."""
    w, x, y, z = (float(v) for v in handle.wxyz)
    pose = np.eye(4)
    pose[:3, :3] = matrix_from_quaternion((x, y, z, w))
    pose[:3, 3] = handle.position
    return pose

"""A motion as copies of the robot's moving links along it, in one scene node for each link."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.kinematics import forward_kinematics
from roboyard.transforms import Array, quaternion_from_matrix, to_wxyz

if TYPE_CHECKING:
    from roboyard.planning import Planner

START, END = np.array([70, 130, 230]), np.array([60, 190, 90])
"""Colours (RGB, 0 to 255) of the first and the last copy."""
OPACITY = 0.22
COPIES = 12
"""Copies along a motion."""


class SweptGhost:
    """Translucent copies of the links that a planner moves."""

    def __init__(self, scene: Any, planner: Planner, name: str = "/plan/swept ghost") -> None:
        """Start without copies.

        Args:
            scene: viser's scene.
            planner: names the links and the joints that move them.
            name: path of the nodes.
        """
        self._scene, self._name = scene, name
        self._chain = planner.robot.chain
        description = planner.robot.model.description
        moving = [
            link
            for link, node in zip(self._chain.links, self._chain.link_node, strict=True)
            if node >= 0 and link in description.link_by_name
        ]
        self._meshes: dict[str, tuple[Array, Any]] = {}
        for name in moving:
            link = description.link_by_name[name]
            parts = shape_meshes(link.visuals) or shape_meshes(link.collisions)
            if parts:
                first = np.cumsum([0, *(len(part.vertices) for part in parts)])
                faces = [np.asarray(part.faces) + k for part, k in zip(parts, first[:-1], strict=True)]
                self._meshes[name] = (
                    np.concatenate([part.vertices for part in parts]),
                    np.concatenate(faces),
                )
        self.nodes: dict[str, Any] = {}
        """Link to its node."""

    def show(self, postures: Array, root: Array) -> None:
        """Show copies.

        Args:
            postures: (k, n) joint positions in the chain's order (rad or m), from start to end.
            root: (4, 4) pose of the robot's root link in the world frame (m).
        """
        self.clear()
        if not len(postures) or not self._meshes:
            return
        poses = root @ forward_kinematics(self._chain, postures, list(self._meshes))
        share = np.linspace(0, 1, len(postures))[:, None]
        colors = np.round(START + share * (END - START)).astype(np.uint8)
        for k, (link, (vertices, faces)) in enumerate(self._meshes.items()):
            self.nodes[link] = self._scene.add_batched_meshes_simple(
                f"{self._name}/{k}",
                vertices,
                faces,
                to_wxyz(quaternion_from_matrix(poses[:, k, :3, :3])),
                poses[:, k, :3, 3],
                batched_colors=colors,
                opacity=OPACITY,
                cast_shadow=False,
                receive_shadow=False,
            )

    def clear(self) -> None:
        """Remove all copies."""
        for node in self.nodes.values():
            node.remove()
        self.nodes.clear()

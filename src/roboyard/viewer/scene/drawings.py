"""Lines, points and texts in the world frame or in link frames, drawn over a world."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.transforms import from_wxyz, matrix_from_quaternion
from roboyard.viewer.scene.texts import SceneText, Texts

Array = NDArray[np.float64]
Owner = tuple[int, int]

DOT = 1e-5
"""Length of a line that is drawn as a point (m)."""
DECIMALS = 2
"""Decimals of a width (pixels); lines of equal width are sent together."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SceneLines:
    """Line segments in one frame."""

    start: Array
    """(k, 3) first end in the frame of `link` (m)."""
    end: Array
    """(k, 3) second end in the frame of `link` (m)."""
    rgb: Array
    """(k, 3) colour, 0 to 1."""
    width: float
    """Width (pixels)."""
    link: Owner | None = None
    """Body id and link index of their frame; None: the world frame."""

    @classmethod
    def dots(cls, positions: Array, rgb: Array, size: float, link: Owner | None = None) -> SceneLines:
        """Return round points at (k, 3) positions (m) of (k, 3) colours, `size` pixels wide."""
        return cls(start=positions, end=positions + np.array([0.0, 0.0, DOT]), rgb=rgb, width=size, link=link)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Drawing:
    """All lines and texts drawn over a world."""

    lines: Sequence[SceneLines] = ()
    texts: Sequence[SceneText] = ()


class Drawings:
    """Draws on the pages of a server; link frames are resolved here, so that few messages are sent."""

    def __init__(self, server: Any) -> None:
        self._scene = server.scene
        self._server = server
        self._texts: Texts | None = None
        self._drawing = Drawing()
        self._groups: list[_Group] = []
        self._nodes: dict[float, Any] = {}
        self._text_links: list[Owner | None] = []
        self._text_places = np.zeros((0, 3))
        self._sent: dict[float, NDArray[np.float32]] = {}
        self._rows: Mapping[Owner, int] | None = None

    def show(self, drawing: Drawing, rows: Mapping[Owner, int], positions: Array, quaternions: Array) -> None:
        """Replace the drawing on the pages.

        Args:
            drawing: lines and texts; passing the same object again costs little.
            rows: body id and link index to the row of its pose; lines and texts of other links are skipped.
            positions: (nbody, 3) positions in the world frame (m).
            quaternions: (nbody, 4) orientations w, x, y, z in the world frame.
        """
        changed = drawing is not self._drawing
        if changed:
            self._groups = _by_width(drawing.lines)
            self._text_links = [text.link for text in drawing.texts]
            self._text_places = np.array([text.position for text in drawing.texts]).reshape(-1, 3)
            for width in [width for width in self._nodes if width not in {g.width for g in self._groups}]:
                self._nodes.pop(width).remove()
                del self._sent[width]
        links_changed = rows is not self._rows
        frames = _Frames(rows, positions, quaternions)
        for group in self._groups:
            if changed or links_changed or group.moves:
                self._show_lines(group, frames)
        if changed or links_changed or any(link is not None for link in self._text_links):
            self._show_texts(drawing, frames)
        self._drawing, self._rows = drawing, rows

    def _show_lines(self, group: _Group, frames: _Frames) -> None:
        ends, there = frames.place(group.links, group.of_link, group.ends)
        points = ends[there].astype(np.float32)
        colors = group.colors[there]
        node, sent = self._nodes.get(group.width), self._sent.get(group.width)
        if node is None or sent is None or len(sent) != len(points):
            if not len(points):
                if node is not None:
                    node.remove()
                    del self._nodes[group.width], self._sent[group.width]
                return
            self._nodes[group.width] = self._scene.add_line_segments(
                f"/drawings/lines {group.width:g}",
                points,
                colors,
                thickness=max(group.width, 0.5),
                thickness_units="screen",
            )
        else:
            if not np.array_equal(points, sent):
                node.points = points
            if not np.array_equal(colors, node.colors):
                node.colors = colors
        self._sent[group.width] = points

    def _show_texts(self, drawing: Drawing, frames: _Frames) -> None:
        if not drawing.texts and self._texts is None:
            return
        if self._texts is None:
            self._texts = Texts(self._server)
        index: dict[Owner | None, int] = {}
        of_link = np.array([index.setdefault(link, len(index)) for link in self._text_links], dtype=np.intp)
        links = list(index)
        places, there = frames.place(links, of_link, self._text_places[:, None])
        turns = frames.turns(links)[of_link] if links else np.zeros((0, 3, 3))
        texts = [text for text, is_there in zip(drawing.texts, there, strict=True) if is_there]
        self._texts.show(texts, places[there][:, 0], turns[there])


@dataclass(frozen=True, kw_only=True, slots=True)
class _Group:
    """All lines of one width (pixels)."""

    width: float
    links: list[Owner | None]
    of_link: NDArray[np.intp]
    """(k,) index into `links`."""
    ends: Array
    """(k, 2, 3) ends, each in the frame of its link (m)."""
    colors: NDArray[np.uint8]
    """(k, 2, 3) RGB of both ends."""

    @property
    def moves(self) -> bool:
        return any(link is not None for link in self.links)


def _by_width(lines: Sequence[SceneLines]) -> list[_Group]:
    by_width: dict[float, list[SceneLines]] = {}
    for part in lines:
        if len(part.start):
            by_width.setdefault(round(float(part.width), DECIMALS), []).append(part)
    groups = []
    for width, parts in by_width.items():
        index: dict[Owner | None, int] = {}
        rows = [index.setdefault(part.link, len(index)) for part in parts]
        start, end, rgb = (
            np.concatenate([np.asarray(getattr(part, name), dtype=float) for part in parts])
            for name in ("start", "end", "rgb")
        )
        colors = np.round(255.0 * np.clip(rgb, 0.0, 1.0)).astype(np.uint8)
        groups.append(
            _Group(
                width=width,
                links=list(index),
                of_link=np.repeat(rows, [len(part.start) for part in parts]),
                ends=np.stack([start, end], axis=1),
                colors=np.repeat(colors[:, None], 2, axis=1),
            )
        )
    return groups


class _Frames:
    """Current poses of links."""

    def __init__(self, rows: Mapping[Owner, int], positions: Array, quaternions: Array) -> None:
        self._rows, self._positions, self._quaternions = rows, positions, quaternions

    def place(
        self, links: list[Owner | None], of_link: NDArray[np.intp], points: Array
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return (k, n, 3) points of link frames in the world frame (m), and (k,) whether the link exists."""
        known = np.array([link is None or link in self._rows for link in links], dtype=bool)
        there = known[of_link] if links else np.zeros(0, dtype=bool)
        if not any(link is not None for link in links):
            return points, there
        turned = np.einsum("kij,knj->kni", self.turns(links)[of_link], points)
        origins = np.array(
            [np.zeros(3) if (row := self._row(at)) is None else self._positions[row] for at in links]
        )
        return turned + origins[of_link][:, None], there

    def turns(self, links: list[Owner | None]) -> Array:
        """Return (k, 3, 3) rotations; identity for the world and for links that do not exist."""
        rows = [self._row(link) for link in links]
        turns = [
            np.eye(3) if row is None else matrix_from_quaternion(from_wxyz(self._quaternions[row]))
            for row in rows
        ]
        return np.array(turns).reshape(-1, 3, 3)

    def _row(self, link: Owner | None) -> int | None:
        return None if link is None else self._rows.get(link)

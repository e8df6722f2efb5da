"""Texts in a page's scene, in any colour, in front of all shapes.

viser's labels have one colour and need a message and an element each. Here one message sends all texts, and a
script in the page draws them over the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import NamedTuple
from roboyard.transforms import matrix_from_quaternion
from roboyard.viewer.page.page_script import PageScript

Array = NDArray[np.float64]

PIXELS = 16
"""Height of a text of size 1 that faces the camera (pixels)."""
HEIGHT = 0.1
"""Height of a text of size 1 that has an orientation in the scene (m)."""

_SCRIPT = """
  const sheet = document.createElement("canvas"), ink = sheet.getContext("2d");
  sheet.id = "roboyard-texts";
  sheet.style.cssText = "position:absolute;inset:0;width:100%%;height:100%%;pointer-events:none";
  let texts = [], seen = "", frame = 0;
  const place = (m, x, y, z) => [0, 1, 2, 3].map(i => m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i]);
  const product = (a, b) => [0, 1, 2, 3].flatMap(
    j => [0, 1, 2, 3].map(i => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + i] * b[4 * j + k], 0)));
  const draw = () => {
    frame = texts.length ? requestAnimationFrame(draw) : 0;
    const page = window.__viserMutable, canvas = page?.canvas, camera = page?.camera;
    const root = page?.nodeRefFromName?.[""];
    if (!canvas || !camera || !root) return;
    const holder = canvas.parentElement;
    if (sheet.parentElement !== holder) holder.appendChild(sheet);
    const scale = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
    const all = product(product(camera.projectionMatrix.elements, camera.matrixWorldInverse.elements),
      root.matrixWorld.elements);
    const now = [...all, wide, high, scale].join();
    if (now === seen) return;
    seen = now;
    sheet.width = wide * scale;
    sheet.height = high * scale;
    const spot = (x, y, z) => {
      const p = place(all, x, y, z);
      return p[3] > 1e-6 ? [(p[0] / p[3] + 1) * wide / 2, (1 - p[1] / p[3]) * high / 2, p[3]] : null;
    };
    const order = texts.map(t => [t, spot(t[1], t[2], t[3])]).filter(pair => pair[1]);
    order.sort((a, b) => b[1][2] - a[1][2]);
    for (const [[words, x, y, z, color, size, axes], at] of order) {
      ink.setTransform(scale, 0, 0, scale, 0, 0);
      if (axes) {
        const part = 1e-3, at_axis = k => spot(...[x, y, z].map((v, i) => v + part * axes[k + i]));
        const right = at_axis(0), up = at_axis(3);
        if (!right || !up) continue;
        const unit = size * %(height)g / 100 / part;
        ink.transform((right[0] - at[0]) * unit, (right[1] - at[1]) * unit,
          (at[0] - up[0]) * unit, (at[1] - up[1]) * unit, at[0], at[1]);
        ink.font = "100px sans-serif";
      } else {
        ink.translate(at[0], at[1]);
        ink.font = `${size * %(pixels)g}px sans-serif`;
      }
      ink.fillStyle = color;
      words.split("\\n").forEach((line, k) => ink.fillText(line, 0, k * 1.2 * parseFloat(ink.font)));
    }
  };
  listen(value => {
    texts = value;
    seen = "";
    if (!frame) draw();
  });
  return () => { cancelAnimationFrame(frame); sheet.remove(); };
"""


class SceneText(NamedTuple):
    """One text and its pose; a tuple, as hundreds may be created for each frame."""

    text: str
    """Text; newlines start new lines."""
    position: tuple[float, float, float]
    """Lower left corner in the frame of `link` (m)."""
    rgb: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """RGB, 0 to 1."""
    size: float = 1.0
    """Factor on the height, `PIXELS` or `HEIGHT`."""
    orientation: tuple[float, float, float, float] | None = None
    """Quaternion x, y, z, w of a frame; the text is in its x-y plane, along x. None: it faces the camera."""
    link: tuple[int, int] | None = None
    """Body id and link index of its frame; None: the world frame."""


class Texts:
    """The texts on all pages of a server."""

    def __init__(self, server: Any) -> None:
        """Start without texts; `server` is a `viser.ViserServer`."""
        self._script = PageScript(
            server, "texts", _SCRIPT % {"pixels": PIXELS, "height": HEIGHT}, lambda client, value: None
        )
        self._shown: list[list[Any]] = []

    def show(self, texts: Sequence[SceneText], positions: Array, rotations: Array) -> None:
        """Replace all texts.

        Args:
            texts: the k texts.
            positions: (k, 3) positions of the texts in the world frame (m).
            rotations: (k, 3, 3) rotations of their frames in the world frame.
        """
        rows = [
            [
                text.text,
                *place,
                _color(text.rgb),
                text.size,
                None if text.orientation is None else _axes(text, turn),
            ]
            for text, place, turn in zip(texts, np.round(positions, 5).tolist(), rotations, strict=True)
        ]
        if rows != self._shown:
            self._script.send(rows)
            self._shown = rows


@lru_cache(maxsize=4096)
def _color(rgb: tuple[float, float, float]) -> str:
    r, g, b = (max(0, min(255, round(255 * value))) for value in rgb)
    return f"#{r:02x}{g:02x}{b:02x}"


def _axes(text: SceneText, turn: Array) -> list[float]:
    assert text.orientation is not None
    axes = turn @ matrix_from_quaternion(text.orientation)
    return np.round(axes[:, :2].T.ravel(), 5).tolist()

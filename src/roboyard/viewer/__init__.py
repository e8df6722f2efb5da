"""View a world on a web page: works over SSH, in a container and in a notebook.

>>> from roboyard.viewer import Viewer
>>> viewer = Viewer(world)          # prints the address
>>> world.step(2400)                # shown live in every open page

Requires the extra `gui`; viser is imported when a viewer is opened.
"""

from __future__ import annotations

from roboyard.viewer.viewer import Viewer

__all__ = ["Viewer"]

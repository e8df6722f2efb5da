"""A window on a world that is a web page: works over SSH, in a container, in a notebook.

>>> from roboyard.viewer import Viewer
>>> viewer = Viewer(world)          # prints the address
>>> world.step(2400)                # whoever has the page open watches

Needs the extra `gui`; viser loads when a viewer is opened.
"""

from __future__ import annotations

from roboyard.viewer.viewer import Viewer

__all__ = ["Viewer"]

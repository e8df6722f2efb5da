"""Axes of meshes."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from roboyard.audit.checks.meshes import file_name
from roboyard.audit.findings import WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import InertialElement, LinkElement, ShapeElement
from roboyard.description.urdf.parse import UrdfElements
from roboyard.transforms import Array
from roboyard.untrusted.files import read_head

Y_TO_Z = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""(4, 4) turn of a mesh whose file is drawn with y up, for programs that honour `<up_axis>`."""
HEAD = 1 << 16
"""Bytes of a DAE file in which its `<up_axis>` is looked for."""
OUTSIDE, INSIDE = 0.1, 0.03
"""Distances of a centre of mass from the box round a mesh, as shares of the box's diagonal, from which it is
plainly outside and up to which it is inside."""
FEWEST, TIMES = 4, 3
"""Links that must speak for turned axes, and how many times as many as speak for the raw ones."""


@check(
    "mesh-up-axis",
    WARNING,
    remedy="turn the origins of these shapes by 1.5708 about x, or export the meshes with z up",
    fixable=True,
    example="(DAE files with y up, which lie across their links as they are)",
)
def mesh_up_axis(urdf: UrdfElements) -> Faults:
    """DAE meshes lie beside their links' centres of mass, but on them once `<up_axis>Y_UP` is applied.

    URDF refers to the raw axes of meshes; some viewers turn them.
    """
    turned = raw = 0
    first: ShapeElement | None = None
    for link in urdf.links:
        if link.inertial is None or not link.has_mass:
            continue
        found = [_distances(shape, link.inertial) for shape in y_up_shapes(link)]
        if not found:
            continue
        as_drawn, as_turned = np.mean(found, axis=0)
        if as_drawn > OUTSIDE and as_turned < INSIDE:
            turned += 1
            first = first or next(y_up_shapes(link))
        elif as_turned > OUTSIDE and as_drawn < INSIDE:
            raw += 1
    if first is not None and first.mesh is not None and turned >= max(FEWEST, TIMES * raw):
        message = (
            f"meshes such as {file_name(first.mesh)} are drawn with y up: on {turned} links they hold the "
            f"centre of mass only once they are turned to z up, on {raw} only as they are"
        )
        yield Fault(at=first, line=first.line, message=message)


def y_up_shapes(link: LinkElement) -> Iterator[ShapeElement]:
    """Yield the shapes of a link whose mesh is a DAE file that states `<up_axis>Y_UP`."""
    for shape in link.shapes:
        path = None if shape.mesh is None else shape.mesh.found.path
        if path is None or path.suffix.lower() != ".dae" or shape.bounds is None:
            continue
        if re.search(rb"<up_axis>\s*Y_UP", read_head(path, HEAD)):
            yield shape


def _distances(shape: ShapeElement, inertial: InertialElement) -> tuple[float, float]:
    """Return the distances of a centre of mass from the box round a mesh as it is and as it is turned, as
    shares of the box's diagonal.
    """
    assert shape.bounds is not None
    lower, upper = shape.bounds
    size = float(np.linalg.norm(upper - lower)) or 1.0

    def outside(frame: Array) -> float:
        point = (np.linalg.inv(frame) @ inertial.origin[:, 3])[:3]
        return float(np.linalg.norm(np.maximum(np.maximum(lower - point, point - upper), 0.0))) / size

    return outside(shape.origin), outside(shape.origin @ Y_TO_Z)

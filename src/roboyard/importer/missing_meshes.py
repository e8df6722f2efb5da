"""Omit shapes whose mesh file is missing, as the user asks."""

from __future__ import annotations

from typing import Literal

from roboyard.description.urdf.parse import UrdfElements
from roboyard.importer.import_log import ImportLog

Policy = Literal["warn", "error"] | None


def without_missing_meshes(source: UrdfElements, policy: Policy, log: ImportLog) -> UrdfElements:
    """Return the elements without the shapes whose mesh file is missing; a warning names each.

    The link's other shapes stay. Meshes outside the robot's folders stay too, which is an error later.

    Args:
        source: the vendor's file.
        policy: "warn" omits visual and collision shapes, "error" none; None omits visual ones.
        log: takes the warnings.
    """
    kinds = ("visual", "collision") if policy == "warn" else () if policy == "error" else ("visual",)
    shapes = [(index, shape) for index, shape in enumerate(source.shapes) if shape.kind in kinds]
    gone = {
        index: shape
        for index, shape in shapes
        if shape.mesh is not None
        and shape.mesh.uri.strip()
        and shape.mesh.found.path is None
        and "is outside" not in (shape.mesh.found.problem or "")
    }
    if not gone:
        return source
    copy = source.editable_copy()
    parts = [(link, shape) for link in copy.links for shape in link.shapes]
    for index in gone:
        link, shape = parts[index]
        link.element.remove(shape.element)
    for shape in gone.values():
        problem = shape.mesh.found.problem if shape.mesh is not None else ""
        uri = shape.mesh.uri if shape.mesh is not None else ""
        log.warn(f"its {shape.kind} without the mesh {uri!r}: {problem}", shape.who)
    return copy.parsed_again()

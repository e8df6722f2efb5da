"""Replace meshes with a negative scale by mirrored files with a positive one.

Isaac Sim mishandles negative scales, and mirrored triangles face inwards. The new file holds the scaled
vertices with the winding reversed; its name ends in the mirrored axes.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from roboyard.description.model import Geometry, Mesh
from roboyard.description.robot_model import RobotModel
from roboyard.importer.context import ImportContext
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh_files import write_obj


def mirror_meshes(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot without negative mesh scales; all shapes keep their places."""
    made: dict[tuple[Path, tuple[float, float, float]], Path] = {}

    def mirrored(geometry: Geometry, who: str) -> Geometry:
        if not isinstance(geometry, Mesh) or geometry.path is None or min(geometry.scale) >= 0:
            return geometry
        key = (geometry.path, geometry.scale)
        if key not in made:
            axes = "".join(
                f"_{axis}" for axis, factor in zip("xyz", geometry.scale, strict=True) if factor < 0
            )
            made[key] = _free_path(geometry.path, f"{geometry.path.stem}_mirror{axes}", set(made.values()))
            write_obj(scaled(load_mesh(geometry.path), geometry.scale), made[key], materials=True)
            context.log.note(f"{geometry.path.name} with scale {geometry.scale} became {made[key].name}", who)
        uri = made[key].relative_to(context.urdf_folder).as_posix()
        return Mesh(uri=uri, path=made[key], scale=(1.0, 1.0, 1.0))

    links = []
    for link in robot.description.links:
        who = f'link "{link.name}"'
        links.append(
            replace(
                link,
                visuals=tuple(replace(v, geometry=mirrored(v.geometry, who)) for v in link.visuals),
                collisions=tuple(replace(c, geometry=mirrored(c.geometry, who)) for c in link.collisions),
            )
        )
    return replace(robot, description=replace(robot.description, links=tuple(links)))


def _free_path(source: Path, stem: str, taken: set[Path]) -> Path:
    number = 0
    while True:
        path = source.with_name(f"{stem}_{number}.obj" if number else f"{stem}.obj")
        if path not in taken and not path.exists():
            return path
        number += 1

"""A cleaned URDF with everything it needs beside it.

| concept | where it goes |
| --- | --- |
| the robot | `<folder>/<name>.urdf`, `<robot name="...">` |
| links, joints, materials | as `roboyard.description.write_urdf` writes them, unread XML included |
| mesh file | `meshes/...`, copied once with the materials and images it names, plain file name |
| mesh already inside the folder | used from there |
| mesh made in memory | `meshes/<shape>.obj` |
| texture | `textures/...` |
| sensors, drives, planning data | not in URDF; see the other writers |
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from roboyard.description.files.copy_files import FileCopier
from roboyard.description.model import Collision, Geometry, Link, Material, Mesh, RobotDescription, Visual
from roboyard.description.urdf.write import write_urdf
from roboyard.export.export_result import ExportResult
from roboyard.export.geometry import stem
from roboyard.export.names import free_name, identifier
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.mesh_files import write_obj

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


def write(robot: RobotModel, folder: Path | str) -> ExportResult:
    """Write `<folder>/<name>.urdf` with its meshes and textures; every reference is relative.

    Raises:
        DescriptionError: the robot has a heightfield, which URDF cannot describe.
        OSError: a file cannot be written.
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    beside = _Beside(folder=place, stage=FileCopier(folder=place))
    beside.reserve(robot.description)
    target = place / f"{robot.name}.urdf"
    write_urdf(_localized(robot.description, robot.name, beside), target)
    return ExportResult(files=(target, *beside.files()), notes=tuple(beside.notes))


def _localized(description: RobotDescription, name: str, beside: _Beside) -> RobotDescription:
    """Return the description with every mesh and image in the folder, by relative path."""
    return replace(
        description,
        name=name,
        links=tuple(_link(link, beside) for link in description.links),
        materials=tuple(beside.material(material) for material in description.materials),
    )


def _link(link: Link, beside: _Beside) -> Link:
    return replace(
        link,
        visuals=tuple(_visual(visual, link, beside) for visual in link.visuals),
        collisions=tuple(_collision(collision, link, beside) for collision in link.collisions),
    )


def _visual(visual: Visual, link: Link, beside: _Beside) -> Visual:
    material = None if visual.material is None else beside.material(visual.material)
    return replace(visual, geometry=beside.geometry(visual, link.name), material=material)


def _collision(collision: Collision, link: Link, beside: _Beside) -> Collision:
    return replace(collision, geometry=beside.geometry(collision, link.name))


@dataclass(kw_only=True, eq=False)
class _Beside:
    """Files beside the URDF, each written once."""

    folder: Path
    stage: FileCopier
    made: dict[int, tuple[TriangleMesh, str]] = field(default_factory=dict)
    """Meshes made in memory by identity (kept alive here), with their relative path."""
    kept: dict[Path, str] = field(default_factory=dict)
    """Files that were in the folder before."""
    notes: list[str] = field(default_factory=list)

    def reserve(self, description: RobotDescription) -> None:
        """Reserve the names of files that are in the folder already."""
        for link in description.links:
            for shape in (*link.visuals, *link.collisions):
                if isinstance(shape.geometry, Mesh) and shape.geometry.path is not None:
                    self._inside(shape.geometry.path)

    def files(self) -> tuple[Path, ...]:
        """Return every file that was written or kept, without materials and images of meshes."""
        relative = [*self.stage.staged.values(), *(uri for _, uri in self.made.values()), *self.kept.values()]
        return tuple(self.folder / uri for uri in relative)

    def geometry(self, shape: Visual | Collision, link: str) -> Geometry:
        """Return the shape's geometry; a mesh with a relative file name."""
        mesh = shape.geometry
        if not isinstance(mesh, Mesh):
            return mesh
        if mesh.data is not None:
            return replace(mesh, uri=self._export(mesh.data, f"{link}_{stem(shape.name, mesh)}"))
        if mesh.path is None:
            self.notes.append(f'link "{link}": mesh "{mesh.uri}" was not found; its reference is unchanged')
            return mesh
        return replace(mesh, uri=self._inside(mesh.path) or self.stage.mesh(mesh.path))

    def material(self, material: Material) -> Material:
        """Return the material; its image with a relative file name."""
        if material.texture is None:
            return material
        uri = self._inside(material.texture) or self.stage.image(material.texture)
        return replace(material, texture_uri=uri)

    def _inside(self, path: Path) -> str | None:
        """Return the relative path of a file that is in the folder already; else None."""
        resolved, root = path.resolve(), self.folder.resolve()
        if not resolved.is_relative_to(root):
            return None
        uri = resolved.relative_to(root).as_posix()
        self.kept[resolved] = uri
        self.stage.taken.add(uri.casefold())
        return uri

    def _export(self, mesh: TriangleMesh, name: str) -> str:
        found = self.made.get(id(mesh))
        if found is not None:
            return found[1]
        base = identifier(name, "mesh")
        taken = {key.rpartition("/")[2].rpartition(".")[0] for key in self.stage.taken}
        uri = f"meshes/{free_name(base.casefold(), taken)}.obj"
        self.stage.taken.add(uri.casefold())
        self.made[id(mesh)] = (mesh, uri)
        (self.folder / "meshes").mkdir(exist_ok=True)
        write_obj(mesh, self.folder / uri)
        if mesh.colors is not None or mesh.texture is not None:
            self.notes.append(f"{uri}: made in memory; written without the colours of its faces")
        return uri

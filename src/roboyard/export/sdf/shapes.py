"""Visual and collision shapes of SDF, with their meshes and images."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

from roboyard.description.files.copy_files import FileCopier
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Link,
    Material,
    Mesh,
    Plane,
    Sphere,
    Visual,
)
from roboyard.export.geometry import stem
from roboyard.export.names import free_name, identifier
from roboyard.export.sdf.xml import add, add_pose
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.mesh_files import write_obj


@dataclass(kw_only=True, eq=False)
class Files:
    """Meshes and images of an SDF file, each once."""

    folder: Path
    """The SDF file's folder."""
    shared: Path | None = None
    """Files below it are used where they are."""
    copier: FileCopier = field(init=False)
    made: dict[int, tuple[TriangleMesh, str]] = field(default_factory=dict)
    """Meshes made in memory by identity, with their relative path."""
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.copier = FileCopier(folder=self.folder)

    def written(self) -> tuple[Path, ...]:
        """Return the files that were written."""
        names = [*self.copier.staged.values(), *(name for _, name in self.made.values())]
        return tuple(self.folder / name for name in names)

    def mesh(self, mesh: Mesh, name: str) -> str | None:
        """Return the path of a mesh, relative to the SDF file; None where there is no file."""
        if mesh.data is not None:
            return self._made(mesh.data, name)
        if mesh.path is None:
            return None
        return self._shared(mesh.path) or self.copier.mesh(mesh.path)

    def image(self, path: Path) -> str:
        """Return the path of an image, relative to the SDF file."""
        return self._shared(path) or self.copier.image(path)

    def _shared(self, path: Path) -> str | None:
        if self.shared is None or not path.resolve().is_relative_to(self.shared.resolve()):
            return None
        return Path(os.path.relpath(path.resolve(), self.folder.resolve())).as_posix()

    def _made(self, mesh: TriangleMesh, name: str) -> str:
        found = self.made.get(id(mesh))
        if found is None:
            taken = {known.rpartition("/")[2].rpartition(".")[0] for known in self.copier.taken}
            place = f"meshes/{free_name(identifier(name, 'mesh').casefold(), taken)}.obj"
            self.copier.taken.add(place)
            (self.folder / "meshes").mkdir(exist_ok=True)
            write_obj(mesh, self.folder / place)
            found = self.made[id(mesh)] = (mesh, place)
        return found[1]


def add_shapes(element: ET.Element, link: Link, files: Files) -> None:
    """Add a link's visual and collision shapes."""
    used: set[str] = set()
    for kind, shapes in (("visual", link.visuals), ("collision", link.collisions)):
        for shape in shapes:
            made = ET.Element(kind, name=free_name(shape.name or f"{link.name}_{kind}", used))
            if not _add_geometry(made, shape, link.name, files):
                continue
            used.add(made.get("name", ""))
            if isinstance(shape, Visual):
                _add_material(made, shape.material, files)
            else:
                _add_surface(made, link.contact)
            element.append(made)


def _add_geometry(element: ET.Element, shape: Visual | Collision, link: str, files: Files) -> bool:
    """Add pose and geometry; return whether SDF can hold it."""
    add_pose(element, shape.origin)
    geometry = add(element, "geometry")
    match shape.geometry:
        case Box(size=size):
            add(add(geometry, "box"), "size", size)
        case Sphere(radius=radius):
            add(add(geometry, "sphere"), "radius", radius)
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length):
            made = add(geometry, type(shape.geometry).__name__.lower())
            add(made, "radius", radius)
            add(made, "length", length)
        case Plane(normal=normal):
            made = add(geometry, "plane")
            add(made, "normal", normal)
            add(made, "size", (100.0, 100.0))
        case Mesh() as mesh:
            uri = files.mesh(mesh, f"{link}_{stem(shape.name, mesh)}")
            if uri is None:
                files.notes.append(f'link "{link}": mesh "{mesh.uri}" was not found; omitted')
                return False
            made = add(geometry, "mesh")
            add(made, "uri", uri)
            if mesh.scale != (1.0, 1.0, 1.0):
                add(made, "scale", mesh.scale)
        case _:
            files.notes.append(f'link "{link}": a {type(shape.geometry).__name__} is omitted')
            return False
    return True


def _add_material(element: ET.Element, material: Material | None, files: Files) -> None:
    if material is None or (material.rgba is None and material.texture is None):
        return
    made = add(element, "material")
    colour = material.rgba or (1.0, 1.0, 1.0, 1.0)
    add(made, "ambient", colour)
    add(made, "diffuse", colour)
    if material.texture is not None:
        metal = add(add(made, "pbr"), "metal")
        add(metal, "albedo_map", files.image(material.texture))
        add(metal, "metalness", 0.0)
    if colour[3] < 1.0:
        add(element, "transparency", 1.0 - colour[3])


def _add_surface(element: ET.Element, contact: Contact | None) -> None:
    if contact is None or (contact.lateral_friction is None and contact.restitution is None):
        return
    surface = add(element, "surface")
    if contact.lateral_friction is not None:
        ode = add(add(surface, "friction"), "ode")
        add(ode, "mu", contact.lateral_friction)
        add(ode, "mu2", contact.lateral_friction)
    if contact.restitution is not None:
        add(add(surface, "bounce"), "restitution_coefficient", contact.restitution)

"""Soft bodies of files: the arguments of loadSoftBody, and URDF files with a `<deformable>` element."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from roboyard._records import dataclass
from roboyard.description.urdf.xml import line_of, read_xml
from roboyard.errors import DescriptionError, MeshError
from roboyard.shapes.load import MAX_FILE_BYTES, load_for_texture, load_mesh
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.readers.parts import TooManyTrianglesError
from roboyard.shapes.readers.read_obj import read_obj_surface
from roboyard.shapes.readers.read_vtk import load_tetrahedra
from roboyard.sim.soft.materials import NeoHookean, Springs
from roboyard.transforms import Array
from roboyard.untrusted.files import read_file

TAGS = "deformable", "reduced_deformable"
DEFAULT_MARGIN = 0.02
"""Collision margin that files and scripts do not give (m)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SoftModel:
    """A soft body as a file or a script describes it."""

    name: str
    file: Path
    """The mesh that cameras see."""
    nodes: Array
    """(n, 3) (m)."""
    elements: np.ndarray
    """(m, 3) triangles or (m, 4) tetrahedra."""
    skin: TriangleMesh | None
    """Visible mesh in the same frame; None for the surface of the elements."""
    materials: tuple[Springs | NeoHookean, ...]
    mass: float = 1.0
    margin: float = DEFAULT_MARGIN
    """Distance from the nodes at which surfaces are (m)."""
    friction: float = 1.0
    self_collision: bool = False
    repulsion: float = 0.5
    """Stiffness of the springs that keep its parts apart (N/m)."""


def read_shape(
    file: Path, simulated: Path | None, scale: float
) -> tuple[Array, np.ndarray, TriangleMesh | None]:
    """Return nodes (n, 3) (m) and elements, and the visible mesh if it is another one.

    Args:
        file: OBJ or VTK file of the visible mesh.
        simulated: of the nodes; None for the same file.
        scale: of all lengths.

    Raises:
        MeshError: a file cannot be read.
    """
    of_nodes = simulated or file
    if of_nodes.suffix.lower() == ".vtk":
        nodes, elements = load_tetrahedra(of_nodes)
        used, places = np.unique(elements, return_inverse=True)
        nodes, elements = nodes[used], places.reshape(elements.shape)
    else:
        nodes, elements = _surface(of_nodes)
    skin = None if file.suffix.lower() == ".vtk" else _visible(file, scale)
    return nodes * scale, elements, skin


def _visible(file: Path, scale: float) -> TriangleMesh:
    """Return a visible mesh (m) with the texture coordinates of its file, for its own or another image.

    It is white, also where the file has colours, and without coordinates it shows an image's middle.
    """
    mesh = load_mesh(file)
    if mesh.uv is None:
        mesh = load_for_texture(file) or mesh
    uv = np.full((len(mesh.vertices), 2), 0.5) if mesh.uv is None else mesh.uv
    return TriangleMesh(
        vertices=mesh.vertices if scale == 1.0 else mesh.vertices * scale,
        faces=mesh.faces, uv=uv, texture=mesh.texture,
    )  # fmt: skip


def _surface(file: Path) -> tuple[Array, np.ndarray]:
    if file.suffix.lower() != ".obj":
        raise MeshError(
            f"soft bodies are made of .obj or .vtk files, not of {file.suffix!r}; convert it", file=file
        )
    try:
        return read_obj_surface(read_file(file, MAX_FILE_BYTES))
    except (OSError, ValueError, TooManyTrianglesError) as problem:
        raise MeshError(f"not a surface: {' '.join(str(problem).split())[:200]}", file=file) from None


def describes_deformable(file: Path) -> bool:
    """Return whether a URDF file describes a soft body; False for what is no XML."""
    try:
        root, _ = read_xml(file)
    except DescriptionError:
        return False
    return any(root.find(tag) is not None for tag in TAGS)


def read_deformable(file: Path, find: Callable[[str], Path | None], scale: float) -> SoftModel:
    """Return the soft body of a URDF file.

    A `<reduced_deformable>`, whose vibration modes Bullet reads from further files, becomes a solid of a
    similar stiffness: 1 MPa, Poisson's ratio 0.3, times its `stiffness_scale` / 100.

    Args:
        file: URDF file.
        find: function that returns the path of a mesh that the file names.
        scale: of all lengths.

    Raises:
        DescriptionError: an element is missing, or a number is wrong.
        MeshError: a mesh cannot be read.
    """
    root, _ = read_xml(file)
    element = next(found for tag in TAGS if (found := root.find(tag)) is not None)

    def number(path: str, attribute: str, default: float) -> float:
        found = element.find(path)
        given = None if found is None else found.get(attribute)
        if given is None:
            return default
        try:
            value = float(given)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise DescriptionError(
                f"<{path}> has {attribute}={given[:40]!r}; give a number",
                file=file, line=line_of(element), element=f"<{element.tag}>",
            )  # fmt: skip
        return value

    def mesh(tag: str) -> Path | None:
        found = element.find(tag)
        name = None if found is None else found.get("filename")
        if name is None:
            return None
        path = find(name)
        if path is None:
            raise DescriptionError(
                f"<{tag}> names {name[:80]!r}, which does not exist; correct the name",
                file=file, line=line_of(element), element=f"<{element.tag}>",
            )  # fmt: skip
        return path

    visual, simulated = mesh("visual"), mesh("collision") or mesh("sim")
    if visual is None:
        raise DescriptionError(
            f'<{element.tag}> has no <visual filename="...">; add one', file=file, line=line_of(element)
        )
    nodes, elements, skin = read_shape(visual, simulated, scale)
    reduced = element.tag == "reduced_deformable"
    materials: list[Springs | NeoHookean] = []
    if reduced:
        shear = 4e3 * number("stiffness_scale", "value", 100.0)
        materials.append(
            NeoHookean(mu=shear, lam=1.5 * shear, damping=number("damping_coefficient", "value", 0.0))
        )
    if element.find("neohookean") is not None:
        materials.append(
            NeoHookean(
                mu=number("neohookean", "mu", 1.0),
                lam=number("neohookean", "lambda", 1.0),
                damping=number("neohookean", "damping", 0.0),
            )
        )
    if element.find("spring") is not None:
        bending = element.find("spring")
        has_bending = bending is not None and bending.get("bending_stiffness") is not None
        materials.append(
            Springs(
                stiffness=number("spring", "elastic_stiffness", 1.0),
                damping=number("spring", "damping_stiffness", 0.0),
                bending_stiffness=number("spring", "bending_stiffness", 0.0) if has_bending else None,
            )
        )
    return SoftModel(
        name=element.get("name") or root.get("name") or file.stem,
        file=visual,
        nodes=nodes,
        elements=elements,
        skin=skin,
        materials=tuple(materials),
        mass=number("mass", "value", 1.0) if reduced else number("inertial/mass", "value", 1.0),
        margin=number("collision_margin", "value", DEFAULT_MARGIN),
        friction=number("friction", "value", 1.0),
    )

"""Mesh files that are missing, unreadable or faulty."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import MeshElement, ShapeElement
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of
from roboyard.shapes.readers.references import missing_files

MANY_TRIANGLES = 100_000


def first_uses(urdf: UrdfElements) -> Iterator[tuple[ShapeElement, MeshElement, str]]:
    """The first use of each URI, and words for the others."""
    uses: dict[str, list[tuple[ShapeElement, MeshElement]]] = {}
    for shape, mesh in urdf.mesh_shapes:
        uses.setdefault(mesh.uri, []).append((shape, mesh))
    for found in uses.values():
        more = len(found) - 1
        yield *found[0], (f" (and in {more} more place{'s' if more > 1 else ''})" if more else "")


def file_name(mesh: MeshElement) -> str:
    """Name of the file that was found, or else the URI."""
    return mesh.uri if mesh.found.path is None else mesh.found.path.name


def _by_file(urdf: UrdfElements) -> Iterator[tuple[ShapeElement, MeshElement, Path]]:
    """The first use of each file found."""
    seen: set[Path] = set()
    for shape, mesh in urdf.mesh_shapes:
        path = mesh.found.path
        if path is not None and path not in seen:
            seen.add(path)
            yield shape, mesh, path


def _unreadable(urdf: UrdfElements, *words: str, others: bool = False) -> Faults:
    """Files that the loader refuses with one of the words; with `others`, with none of them."""
    for shape, mesh, path in _by_file(urdf):
        if mesh.error is None:
            continue
        text = mesh.error.problems[0].removeprefix(f"{path.name}: ")
        if any(word in text for word in words) != others:
            message, _, remedy = text.rpartition("; ")
            yield Fault(
                at=shape,
                line=line_of(mesh.element),
                message=f"mesh {path.name}: {message or text}",
                remedy=remedy if message else None,
            )


@check(
    "mesh-name-missing",
    ERROR,
    remedy='add filename="..."',
    example="<mesh/>",
)
def mesh_name_missing(urdf: UrdfElements) -> Faults:
    """A `<mesh>` names no file."""
    for shape, mesh in urdf.mesh_shapes:
        if not mesh.uri.strip():
            yield Fault(
                at=shape, line=line_of(mesh.element), message=f"<mesh> in its {shape.kind} names no file"
            )


@check(
    "mesh-missing",
    ERROR,
    remedy="add the file, or name its package's folder with --package name=path",
    example='<mesh filename="meshes/gone.stl"/>',
)
def mesh_missing(urdf: UrdfElements) -> Faults:
    """A mesh file is not found, in any folder that belongs to the robot or was given."""
    for shape, mesh, more in first_uses(urdf):
        problem = mesh.found.problem or ""
        if mesh.found.path is None and mesh.uri.strip() and "is outside" not in problem:
            message, _, remedy = problem.rpartition("; ")
            yield Fault(
                at=shape,
                line=line_of(mesh.element),
                message=f"mesh {mesh.uri!r}: {message or problem}{more}",
                remedy=remedy if message else None,
            )


@check(
    "mesh-outside",
    ERROR,
    remedy="move it into the robot's folders, or name its folder with --package name=path",
    example='<mesh filename="../../../etc/passwd"/>',
)
def mesh_outside(urdf: UrdfElements) -> Faults:
    """A mesh file is outside the robot's folders, links resolved; it is not opened."""
    for shape, mesh, more in first_uses(urdf):
        problem = mesh.found.problem or ""
        if mesh.found.path is None and "is outside" in problem:
            message = f"mesh {mesh.uri!r} is outside the robot's folders, so it is not opened{more}"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-found-nearby",
    INFO,
    remedy="write the reference as the file is called",
    fixable=True,
    example="(Arm.STL written where the disk has arm.stl)",
)
def mesh_found_nearby(urdf: UrdfElements) -> Faults:
    """A mesh is not where the reference says, but found: other case, backslashes, another folder."""
    for shape, mesh, more in first_uses(urdf):
        if mesh.found.path is not None and mesh.found.note:
            message = f"mesh {mesh.uri!r}: {mesh.found.note}{more}"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-format",
    ERROR,
    remedy="convert it to one of .obj, .stl, .dae, .glb, .gltf, .ply",
    example='<mesh filename="part.step"/>',
)
def mesh_format(urdf: UrdfElements) -> Faults:
    """A mesh file is of a format that is not read."""
    yield from _unreadable(urdf, "unknown mesh format")


@check(
    "mesh-lfs",
    ERROR,
    remedy="fetch it with: git lfs pull",
    example="(a git-lfs pointer named part.stl)",
)
def mesh_lfs(urdf: UrdfElements) -> Faults:
    """A mesh file is a git-lfs pointer, not the mesh."""
    yield from _unreadable(urdf, "git-lfs pointer")


@check("mesh-empty", ERROR, remedy="export the mesh again", example="(a file of no bytes, or no triangles)")
def mesh_empty(urdf: UrdfElements) -> Faults:
    """A mesh file holds no triangle."""
    yield from _unreadable(urdf, "the file is empty", "has no triangles")


@check("mesh-not-finite", ERROR, remedy="export the mesh again", example="(a vertex at NaN)")
def mesh_not_finite(urdf: UrdfElements) -> Faults:
    """A mesh has vertices that are not finite numbers."""
    yield from _unreadable(urdf, "not finite")
    for shape, mesh, path in _by_file(urdf):
        if mesh.stats is not None and not mesh.stats.is_finite:
            message = f"mesh {path.name}: its vertices are beyond any size"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


_OWN_CODE = ("unknown mesh format", "git-lfs pointer", "the file is empty", "has no triangles", "not finite")


@check("mesh-unreadable", ERROR, remedy="export the mesh again", example="(a binary STL cut in half)")
def mesh_unreadable(urdf: UrdfElements) -> Faults:
    """A mesh file is broken, too large or may not be read."""
    yield from _unreadable(urdf, *_OWN_CODE, others=True)


@check(
    "mesh-flat",
    WARNING,
    remedy="give a solid shape for collision: a box, or a mesh with thickness",
    example="(a collision mesh in one plane)",
)
def mesh_flat(urdf: UrdfElements) -> Faults:
    """A collision mesh is flat or a line: it has no volume."""
    for shape, mesh in urdf.mesh_shapes:
        if (
            shape.kind == "collision"
            and mesh.stats is not None
            and mesh.stats.is_finite
            and mesh.stats.is_flat
        ):
            message = f"collision mesh {file_name(mesh)} is flat"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-open",
    INFO,
    remedy="close it; Roboyard takes its convex hull where a volume is needed",
    example="(a collision mesh with a hole)",
)
def mesh_open(urdf: UrdfElements) -> Faults:
    """A collision mesh is not a closed surface (holes, edges with one or three faces, mixed winding)."""
    seen: set[Path] = set()
    for shape, mesh in urdf.mesh_shapes:
        facts, path = mesh.stats, mesh.found.path
        if shape.kind != "collision" or facts is None or path is None or path in seen:
            continue
        seen.add(path)
        if facts.is_finite and not facts.is_flat and not facts.is_closed:
            message = f"collision mesh {path.name} is not closed (non-manifold)"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-external-missing",
    INFO,
    remedy="add the file beside the mesh",
    example="(an OBJ whose mtllib names gone.mtl)",
)
def mesh_external_missing(urdf: UrdfElements) -> Faults:
    """A material library or image that a mesh file names is missing; its colours are skipped."""
    for shape, mesh, path in _by_file(urdf):
        names = () if mesh.stats is None else mesh.stats.names
        for name in missing_files(path, names)[:4]:
            message = f"mesh {path.name} names {name!r}, which is not in its folders"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-heavy",
    INFO,
    remedy="reduce it; a collision shape needs a few hundred triangles",
    example="(a mesh of 400,000 triangles)",
)
def mesh_heavy(urdf: UrdfElements) -> Faults:
    """A mesh has over 100,000 triangles."""
    for shape, mesh, path in _by_file(urdf):
        if mesh.stats is not None and mesh.stats.triangles > MANY_TRIANGLES:
            message = f"mesh {path.name} has {mesh.stats.triangles} triangles"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-reference",
    INFO,
    remedy="repair copies the meshes beside the URDF and refers to them by relative path",
    fixable=True,
    example='<mesh filename="package://arm_description/meshes/base.stl"/>',
)
def mesh_reference(urdf: UrdfElements) -> Faults:
    """Meshes are named by package://, file:// or an absolute path: moving the robot breaks them."""
    uses = [(s, m) for s, m in urdf.mesh_shapes if "://" in m.uri or m.uri.strip().startswith("/")]
    if uses:
        shape, mesh = uses[0]
        message = f"{len(uses)} meshes are not named by a relative path (first: {mesh.uri!r})"
        yield Fault(at=shape, line=line_of(mesh.element), message=message, links=())


@check(
    "mesh-file-name",
    INFO,
    remedy="repair copies it under a plain name",
    fixable=True,
    example='<mesh filename="meshes/left arm (1).stl"/>',
)
def mesh_file_name(urdf: UrdfElements) -> Faults:
    """A mesh's file name holds blanks, parentheses or characters beyond ASCII, which break USD paths."""
    for shape, mesh, more in first_uses(urdf):
        name = mesh.uri.replace("\\", "/").rpartition("/")[2]
        odd = sorted({c for c in name if not c.isascii() or not (c.isalnum() or c in "._-+")})
        if odd:
            message = f"mesh file {name!r} has {_listed(odd)} in its name{more}"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


_SPOKEN = {" ": "blanks", "\t": "tabs", "(": "parentheses", ")": "parentheses", "'": "quotes", '"': "quotes"}


def _listed(characters: list[str]) -> str:
    """A list of characters in words: blanks, parentheses and “é”."""
    words = list(
        dict.fromkeys(
            _SPOKEN.get(c) or (f"“{c}”" if c.isprintable() else f"U+{ord(c):04X}") for c in characters
        )
    )
    if len(words) > 4:
        words = [*words[:3], f"{len(words) - 3} more kinds of characters"]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"

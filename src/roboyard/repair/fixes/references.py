"""References to meshes. The files themselves are copied in any case."""

from __future__ import annotations

from collections.abc import Sequence

from roboyard.audit.registry import Fault
from roboyard.description.urdf.elements import ShapeElement
from roboyard.description.urdf.xml import line_of
from roboyard.repair.registry import Change, Changes, RepairContext, fix


def _redirected(context: RepairContext, uris: set[str]) -> Changes:
    """Point the references at the copied files."""
    known: set[str] = set()
    for shape, mesh in context.urdf.mesh_shapes:
        if mesh.uri in uris and mesh.found.path is not None and id(mesh.element) not in context.moved:
            new = context.copier.mesh(mesh.found.path)
            mesh.element.set("filename", new)
            context.moved.add(id(mesh.element))
            if new != mesh.uri and mesh.uri not in known:
                known.add(mesh.uri)
                line = line_of(mesh.element)
                yield Change(element=shape.who, line=line, before=mesh.uri, after=new)


def _uris(faults: Sequence[Fault]) -> set[str]:
    shapes = [fault.at for fault in faults]
    return {shape.mesh.uri for shape in shapes if isinstance(shape, ShapeElement) and shape.mesh is not None}


@fix("mesh-found-nearby")
def as_on_disk(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Name the file that was found."""
    yield from _redirected(context, _uris(faults))


@fix("mesh-file-name")
def plain_file_name(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Copy the mesh under a plain name."""
    yield from _redirected(context, _uris(faults))


@fix("mesh-reference")
def relative_reference(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Refer to the copied meshes by relative paths."""
    if faults:
        uris = {mesh.uri for _, mesh in context.urdf.mesh_shapes}
        yield from _redirected(context, {uri for uri in uris if "://" in uri or uri.strip().startswith("/")})

"""Body templates: all numbers that a compile of one body alone gives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.description.mass_properties import MassProperties
from roboyard.description.model import Heightfield, Mesh, Plane, RobotDescription
from roboyard.errors import MeshError
from roboyard.shapes.load import load_mesh
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.build.bodies import build
from roboyard.sim.build.inverse_weights import bound_inverse_weights
from roboyard.sim.build.mesh_assets import MeshAssets
from roboyard.sim.build.records import BuildOptions
from roboyard.sim.build.solver_options import new_spec

KINDS = ("body", "jnt", "dof", "tree", "geom", "bvh", "qpos")
"""Kinds of MjModel arrays that have rows for each body, by the prefix of their names."""
STRUCTURE_FIELDS = ("body_simple", "bvh_child", "bvh_depth")
"""Arrays that depend on a body's numbers and on nothing outside it, and that other arrays are ordered by."""
BODY_FIELDS = (
    "explicitinertial", "fuse", "gravcomp", "inertia", "ipos", "iquat", "mass", "mocap", "simple",
)  # fmt: skip
GEOM_FIELDS = (
    "adhesion", "castshadow", "conaffinity", "condim", "contype", "density", "fitscale", "fluid_coefs",
    "fluid_ellipsoid", "friction", "fromto", "gap", "group", "margin", "mass", "material", "meshname", "pos",
    "priority", "quat", "rgba", "size", "solimp", "solmix", "solref", "surfacevel",
)  # fmt: skip
"""Fields of a spec's elements that define a body, beside the types of its geoms: members of enumerations,
which take as long to load as some programs run, are those of the compiled model instead."""

MOST_LINKS = 64
"""Largest number of links of a pooled body."""

Layout = tuple[Any, ...]
"""Bodies of equal layout can use one another's rows: bodies of one link whose rows refer to one another in
the same way, with the same meshes. A body of several links has a layout of its own."""


@dataclass(kw_only=True, slots=True, eq=False)
class BodyTemplate:
    """The numbers of a body, from its description and a compile of it alone."""

    description: RobotDescription
    options: BuildOptions
    mass: MassProperties | None
    notes: tuple[str, ...]
    meshes: tuple[str, ...]
    files: tuple[TriangleMesh, ...]
    """Contents of its mesh files."""
    collisions: int
    """Number of collision geoms; they come before the visual ones."""
    body: dict[str, Any]
    """Fields of the spec's body."""
    geoms: list[dict[str, Any]]
    """Fields of each of the spec's geoms."""
    blocks: dict[str, np.ndarray]
    """Rows of MjModel's arrays that do not depend on the body's place among others."""
    kinds: dict[str, str]
    """Which of `KINDS` each block belongs to."""
    counts: dict[str, int]
    """Rows in each kind of array."""
    layout: Layout
    origin: BodyTemplate | None = None
    """The template whose numbers this one has except for `varied`; None for a compiled one."""
    varied: tuple[str, ...] = ()
    """Names of those blocks."""
    _all_bytes: np.ndarray | None = None
    _given: tuple[dict[str, Any], list[dict[str, Any]]] | None = None

    @property
    def family(self) -> BodyTemplate:
        """The compiled template that this one was computed from."""
        return self if self.origin is None else self.origin

    def is_of(self, description: RobotDescription, options: BuildOptions) -> bool:
        """Whether this is the template of a description with these options."""
        same = self.description is description or self.description == description
        return same and self.options == options and self.is_current()

    def is_current(self) -> bool:
        """Whether the mesh files are unchanged."""
        return not self.files or self.files == mesh_files(self.description, self.options)

    @property
    def all_bytes(self) -> np.ndarray:
        """(n,) bytes of all blocks, one after the other."""
        if self._all_bytes is None:
            whole = b"".join([block.tobytes() for block in self.blocks.values()])
            self._all_bytes = np.frombuffer(whole, np.uint8)
        return self._all_bytes

    def given(self) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Fields of the body and of its geoms that differ from MuJoCo's defaults."""
        if self._given is None:
            plain_body, plain_geom = _defaults()
            differing = [_differing(geom, plain_geom) for geom in self.geoms]
            self._given = _differing(self.body, plain_body), differing
        return self._given


def is_poolable(description: RobotDescription, options: BuildOptions) -> bool:
    """Return whether bodies of a description can be compiled in advance.

    Terrain, concave meshes, infinite planes, drives and mimic joints have rows of other kinds.
    """
    links, joints = description.links, description.joints
    if joints and (options.drives or len(links) > MOST_LINKS or any(joint.mimic for joint in joints)):
        return False
    may_be_concave = options.fixed_base or options.searches_meshes
    if may_be_concave and any(shape.concave for link in links for shape in link.collisions):
        return False
    endless = (Heightfield, Plane) if options.fixed_base else Heightfield
    shapes = (shape for link in links for shape in (*link.collisions, *link.visuals))
    return not any(isinstance(shape.geometry, endless) for shape in shapes)


def make_template(description: RobotDescription, options: BuildOptions) -> BodyTemplate | None:
    """Compile a template; return None where a mesh file is missing or MuJoCo rejects it."""
    spec = new_spec()
    nowhere, unturned = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    try:
        built = build(
            spec, MeshAssets(spec, options.hull_steps), description, "body/", nowhere, unturned, options
        )
    except MeshError:
        return None
    root = built.links[0]
    elements = [*root.geoms, *root.visuals]
    body = _fields(root.element, BODY_FIELDS)
    geoms = [_fields(geom, GEOM_FIELDS) for geom in elements]
    try:
        model = spec.compile()
    except ValueError:
        return None
    for geom, fields in zip(elements, geoms, strict=True):
        fields["type"] = int(model.geom_type[geom.id])
    bound_inverse_weights(model)
    counts = {
        "body": model.nbody - 1,
        "jnt": model.njnt,
        "dof": model.nv,
        "tree": model.ntree,
        "geom": model.ngeom,
        "bvh": int(model.body_bvhnum.sum()),
        "qpos": model.nq,
    }
    blocks, kinds, structure = {}, {}, []
    for name, kind in _row_fields().items():
        start = 1 if kind == "body" else 0
        block = np.array(getattr(model, name)[start : start + counts[kind]])
        if _refers(name):
            structure.append(block.tobytes())
        else:
            blocks[name], kinds[name] = block, kind
    meshes = tuple(mesh for record in built.links for mesh in record.meshes)
    single = len(built.links) == 1
    return BodyTemplate(
        description=description,
        options=options,
        mass=root.mass,
        notes=tuple(built.notes),
        meshes=meshes,
        files=mesh_files(description, options),
        collisions=len(root.geoms),
        body=body,
        geoms=geoms,
        blocks=blocks,
        kinds=kinds,
        counts=counts,
        layout=(tuple(structure), meshes) if single else (object(),),
    )


def mesh_files(description: RobotDescription, options: BuildOptions) -> tuple[TriangleMesh, ...]:
    """Return the contents of those mesh files of a description that are compiled, as they are now."""
    shapes = [shape.geometry for link in description.links for shape in link.collisions]
    if options.visual_geoms:
        shapes += [shape.geometry for link in description.links for shape in link.visuals]
    paths = [g.path for g in shapes if isinstance(g, Mesh) and g.data is None and g.path is not None]
    try:
        return tuple(load_mesh(path) for path in paths)
    except MeshError:
        return ()


def write_elements(
    element: Any, geoms: Sequence[Any], template: BodyTemplate, former: BodyTemplate | None
) -> None:
    """Write a template's fields into a body and its geoms in a spec.

    Args:
        element: the body.
        geoms: its geoms.
        template: the template.
        former: the template that they agree with, so that only what differs is written; None for all.
    """
    if former is template:
        return
    written = [(element, template.body), *zip(geoms, template.geoms, strict=True)]
    known = [{}] * len(written) if former is None else [former.body, *former.geoms]
    for (part, fields), before in zip(written, known, strict=True):
        for name, value in fields.items():
            if former is None or value is not before[name]:
                setattr(part, name, value)


def row_starts(model: Any, row: int, links: int = 1) -> dict[str, int]:
    """Return a body's first row in each kind of array; -1 where it has none."""
    rows = range(row, row + links)
    joint = _first(model.body_jntadr, rows)
    return {
        "body": row,
        "jnt": joint,
        "dof": _first(model.body_dofadr, rows),
        "tree": _first(model.body_treeid, rows),
        "geom": _first(model.body_geomadr, rows),
        "bvh": _first(model.body_bvhadr, rows),
        "qpos": int(model.jnt_qposadr[joint]) if joint >= 0 else -1,
    }


def _first(places: np.ndarray, rows: range) -> int:
    return next((int(places[row]) for row in rows if places[row] >= 0), -1)


def kind_of(name: str) -> str:
    """Return the kind, one of `KINDS`, of an array of MjModel."""
    return "qpos" if name.startswith("qpos") else name.partition("_")[0]


@cache
def _row_fields() -> dict[str, str]:
    """Return the arrays of MjModel with rows for each body, and their kinds."""
    accessors = set(KINDS)  # `MjModel.body(name)` and its siblings
    named = (n for n in dir(mujoco.MjModel) if n not in accessors and not n.endswith("_user"))
    return {name: kind_of(name) for name in named if kind_of(name) in KINDS}


@cache
def _defaults() -> tuple[dict[str, Any], dict[str, Any]]:
    """Return MuJoCo's defaults of the fields of a body and of a geom."""
    body = new_spec().worldbody.add_body()
    geom = {**_fields(body.add_geom(), GEOM_FIELDS), "type": int(mujoco.mjtGeom.mjGEOM_SPHERE)}
    return _fields(body, BODY_FIELDS), geom


def _refers(name: str) -> bool:
    """Return whether an array holds references between rows."""
    return name.endswith(("id", "adr", "num")) or name in STRUCTURE_FIELDS


def _fields(element: Any, names: tuple[str, ...]) -> dict[str, Any]:
    """Copy the values of an element's fields."""
    values = {name: getattr(element, name) for name in names}
    return {name: np.array(v) if isinstance(v, np.ndarray) else v for name, v in values.items()}


def _differing(fields: dict[str, Any], plain: dict[str, Any]) -> dict[str, Any]:
    return {
        name: v for name, v in fields.items() if not np.array_equal(v, plain[name], equal_nan=_is_real(v))
    }


def _is_real(value: Any) -> bool:
    return isinstance(value, (float, np.ndarray))

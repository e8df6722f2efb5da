"""What MuJoCo makes of a body: every number of a compile of that body alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import mujoco
import numpy as np

from roboyard.description.mass_properties import MassProperties
from roboyard.description.model import Heightfield, Mesh, Plane, RobotDescription
from roboyard.errors import MeshError
from roboyard.shapes.load import load_mesh
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.build.bodies import build
from roboyard.sim.build.mesh_assets import MeshAssets
from roboyard.sim.build.records import BuildOptions
from roboyard.sim.build.solver_options import new_spec

KINDS = ("body", "jnt", "dof", "tree", "geom", "bvh", "qpos")
"""Arrays of MjModel that have rows of their own for each body, by the beginning of their names."""
LINKS_WITHIN = ("body_simple", "bvh_child", "bvh_depth")
"""Arrays that depend on a body's numbers and on nothing outside it, and that others are laid out by."""
BODY_FIELDS = (
    "explicitinertial", "fuse", "gravcomp", "inertia", "ipos", "iquat", "mass", "mocap", "simple", "sleep",
)  # fmt: skip
GEOM_FIELDS = (
    "adhesion", "castshadow", "conaffinity", "condim", "contype", "density", "fitscale", "fluid_coefs",
    "fluid_ellipsoid", "friction", "fromto", "gap", "group", "margin", "mass", "material", "meshname", "pos",
    "priority", "quat", "rgba", "size", "solimp", "solmix", "solref", "surfacevel", "type", "typeinertia",
)  # fmt: skip
"""Fields of a spec's elements that say what a body is."""

MOST_LINKS = 64
"""Of a body that is worth parking."""

Make = tuple[Any, ...]
"""Bodies of one make can take one another's rows: of one link, whose rows refer to one another in the same
way, with the same meshes. A body of several links is a make of its own."""


@dataclass(kw_only=True, slots=True, eq=False)
class BodyTemplate:
    """A body as its description and a compile of it alone give it."""

    description: RobotDescription
    options: BuildOptions
    mass: MassProperties | None
    notes: tuple[str, ...]
    meshes: tuple[str, ...]
    files: tuple[TriangleMesh, ...]
    """What the mesh files held."""
    collisions: int
    """How many of the geoms touch things; they come before the visual ones."""
    body: dict[str, Any]
    """Fields of the spec's body."""
    geoms: list[dict[str, Any]]
    """Fields of each of the spec's geoms."""
    blocks: dict[str, np.ndarray]
    """Rows of MjModel's arrays that are the same wherever the body lies among others."""
    kinds: dict[str, str]
    """Which of `KINDS` each block belongs to."""
    counts: dict[str, int]
    """Rows in each kind of array."""
    make: Make
    origin: BodyTemplate | None = None
    """The mould whose numbers this one has but for `varied`; None for one that was compiled."""
    varied: tuple[str, ...] = ()
    """Names of those blocks."""
    _given: tuple[dict[str, Any], list[dict[str, Any]]] | None = None

    @property
    def family(self) -> BodyTemplate:
        """The compiled mould that this one comes from."""
        return self if self.origin is None else self.origin

    def is_of(self, description: RobotDescription, options: BuildOptions) -> bool:
        """Whether it is the mould of this description."""
        same = self.description is description or self.description == description
        return same and self.options == options and self.is_current()

    def is_current(self) -> bool:
        """Whether the mesh files still hold what they did."""
        return not self.files or self.files == mesh_files(self.description)

    def given(self) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Those fields of the body and of its geoms that are not MuJoCo's defaults."""
        if self._given is None:
            plain_body, plain_geom = _defaults()
            differing = [_differing(geom, plain_geom) for geom in self.geoms]
            self._given = _differing(self.body, plain_body), differing
        return self._given


def can_wait(description: RobotDescription, options: BuildOptions) -> bool:
    """Whether bodies of a description can be compiled beforehand.

    Terrain, endless planes, drives and mimic joints have rows of other kinds.
    """
    links, joints = description.links, description.joints
    if joints and (options.drives or len(links) > MOST_LINKS or any(joint.mimic for joint in joints)):
        return False
    endless = (Heightfield, Plane) if options.fixed_base else Heightfield
    shapes = (shape for link in links for shape in (*link.collisions, *link.visuals))
    return not any(isinstance(shape.geometry, endless) for shape in shapes)


def make_template(description: RobotDescription, options: BuildOptions) -> BodyTemplate | None:
    """The mould of a description; None where its mesh files are gone or MuJoCo refuses it."""
    spec = new_spec()
    nowhere, unturned = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    try:
        built = build(spec, MeshAssets(spec), description, "", nowhere, unturned, options)
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
        files=mesh_files(description),
        collisions=len(root.geoms),
        body=body,
        geoms=geoms,
        blocks=blocks,
        kinds=kinds,
        counts=counts,
        make=(tuple(structure), meshes) if single else (object(),),
    )


def mesh_files(description: RobotDescription) -> tuple[TriangleMesh, ...]:
    """The meshes of a description that come from files, as the files are now; each is loaded once."""
    links = description.links
    shapes = (shape.geometry for link in links for shape in (*link.collisions, *link.visuals))
    paths = [g.path for g in shapes if isinstance(g, Mesh) and g.data is None and g.path is not None]
    try:
        return tuple(load_mesh(path) for path in paths)
    except MeshError:
        return ()


def row_starts(model: Any, row: int, links: int = 1) -> dict[str, int]:
    """First row of a body of some links in each kind of MuJoCo's arrays; -1 where it has none."""
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
    """Which of `KINDS` an array of MjModel belongs to."""
    return "qpos" if name.startswith("qpos") else name.partition("_")[0]


@cache
def _row_fields() -> dict[str, str]:
    """The arrays of MjModel that have rows for each body, and their kinds; `body_user` is the user's own."""
    accessors = set(KINDS)  # `MjModel.body(name)` and its siblings
    named = (n for n in dir(mujoco.MjModel) if n not in accessors and not n.endswith("_user"))
    return {name: kind_of(name) for name in named if kind_of(name) in KINDS}


@cache
def _defaults() -> tuple[dict[str, Any], dict[str, Any]]:
    """What MuJoCo gives the fields of a body and of a geom of which nothing is said."""
    body = new_spec().worldbody.add_body()
    return _fields(body, BODY_FIELDS), _fields(body.add_geom(), GEOM_FIELDS)


def _refers(name: str) -> bool:
    """Whether an array says how rows refer to one another rather than what a body is."""
    return name.endswith(("id", "adr", "num")) or name in LINKS_WITHIN


def _fields(element: Any, names: tuple[str, ...]) -> dict[str, Any]:
    """Values of an element's fields, copied out of the spec."""
    values = {name: getattr(element, name) for name in names}
    return {name: np.array(v) if isinstance(v, np.ndarray) else v for name, v in values.items()}


def _differing(fields: dict[str, Any], plain: dict[str, Any]) -> dict[str, Any]:
    return {
        name: v for name, v in fields.items() if not np.array_equal(v, plain[name], equal_nan=_is_real(v))
    }


def _is_real(value: Any) -> bool:
    return isinstance(value, (float, np.ndarray))

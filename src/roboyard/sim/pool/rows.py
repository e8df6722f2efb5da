"""Rows of MuJoCo's arrays that change hands: a spare becomes a body, a body is parked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from roboyard.sim.build.bodies import build
from roboyard.sim.build.records import BuildOptions, Built
from roboyard.sim.pool.templates import BodyTemplate, row_starts
from roboyard.sim.protocols import EngineBody, PoolEngine
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim.build.mesh_assets import MeshAssets

MASKS = ("geom_contype", "geom_conaffinity", "body_contype", "body_conaffinity")
PARKED_FIELDS = (*MASKS, "geom_rgba")
"""What tells a parked body of one link from one in use."""
PARKED_JOINTS = ("jnt_limited", "dof_frictionloss")
"""What tells parked joints, too, from joints in use: they ask nothing of the solver."""
_NOWHERE, _UNTURNED = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(kw_only=True, slots=True, eq=False)
class PooledBody:
    """Rows of one body in MuJoCo's arrays, and its elements in the spec."""

    name: str
    """While it is nobody's."""
    template: BodyTemplate
    """What its elements in the spec say."""
    element: Any
    """Of the root link."""
    free_joint: Any
    geoms: list[Any]
    """Of the root link."""
    built: Built | None = None
    """All its elements, if it has several links."""
    owner: int = -1
    """Id of the body that lives here; -1 while it is parked."""
    is_pristine: bool = True
    """Nobody has had it yet."""
    starts: dict[str, int] = field(default_factory=dict)
    """First row by kind of array."""

    @property
    def is_free(self) -> bool:
        """Whether another body can move in; one of several links is not made what it was at first again."""
        return self.owner < 0 and (self.is_pristine or self.built is None)

    def rename(self, name: str) -> None:
        """Give its elements the names that a body has whose own begins so (ending in "/")."""
        if self.built is None:
            self.element.name = f"{name}{self.template.description.root.name}"
        else:
            for record in self.built.links:
                record.element.name = f"{name}{record.name}"
                for joint in record.joint_elements:
                    joint.name = name + joint.name.partition("/")[2]
        if self.free_joint is not None:
            self.free_joint.name = f"{self.element.name}/free"


def add_pooled_body(spec: Any, assets: MeshAssets, template: BodyTemplate, name: str) -> PooledBody:
    """Add a spare of a mould's make to a spec."""
    built = None
    if template.description.joints:
        built = build(spec, assets, template.description, f"{name}/", _NOWHERE, _UNTURNED, template.options)
        root = built.links[0]
        element, joint, geoms = root.element, built.free_joint, [*root.geoms, *root.visuals]
    else:
        of_body, of_geoms = template.given()
        element = spec.worldbody.add_body(name=name, **of_body)
        joint = None if template.options.fixed_base else element.add_freejoint(name=name, align=0)
        geoms = [element.add_geom(**fields) for fields in of_geoms]
        for mesh in template.meshes:
            assets.retain(mesh)
    return PooledBody(
        name=name, template=template, element=element, free_joint=joint, geoms=geoms, built=built
    )


class PoolRows:
    """Writes single bodies into a compiled world's arrays."""

    def __init__(self, engine: PoolEngine) -> None:
        self._engine = engine
        self._arrays: dict[str, np.ndarray] = {}
        self._mass = self._inertia = 0.0
        self._dofs = 0
        self._away: dict[int, tuple[dict[str, int], dict[str, int]]] = {}
        """First rows and counts of all that is parked, by row of the root."""

    def look(self, pool: list[PooledBody]) -> None:
        """After a compile: see where spares lie, and park them."""
        model = self._engine.live_model
        self._arrays, self._away = {}, {}
        for spare in pool:
            counts = spare.template.counts
            spare.starts = row_starts(model, spare.element.id, counts["body"])
            self._park(spare.starts, counts)
        self.update_inertia()

    def update_inertia(self) -> None:
        """Masses or inertias were written, or MuJoCo has summed them up itself."""
        model = self._engine.live_model
        self._mass, self._inertia = float(model.body_mass.sum()), float(model.dof_M0.sum())
        self._dofs = int(model.nv)
        for starts, counts in self._away.values():
            self._count(starts, counts, -1)
        if self._away:
            self._weigh()

    def fill(
        self, spare: PooledBody, template: BodyTemplate, options: BuildOptions, position: Array, wxyz: Array
    ) -> None:
        """Make a parked spare the body of a mould.

        Args:
            spare: of the mould's make.
            mould: what it becomes.
            options: give the masks of the body's geoms.
            position: (3,) m.
            wxyz: (4,) unit.
        """
        starts, related = spare.starts, spare.is_pristine and spare.template.family is template.family
        if not (related and spare.template is template):
            _write_elements(spare, template, plainly=related)
        spare.element.pos, spare.element.quat = position, wxyz
        if not related:
            names: Any = template.blocks
        elif spare.template is template:
            names = PARKED_FIELDS if spare.built is None else (*PARKED_FIELDS, *PARKED_JOINTS)
        else:
            names = (*PARKED_FIELDS, *template.varied, *spare.template.varied)
        blocks, kinds = template.blocks, template.kinds
        for label in names:
            block, start = blocks[label], starts[kinds[label]]
            self._array(label)[start : start + len(block)] = block
        if spare.built is not None and options.contype != template.options.contype:
            self._set_masks(spare, options)
        spare.template, spare.is_pristine = template, False
        row, first, data = starts["body"], starts["qpos"], self._engine.live_data
        self._array("body_pos")[row] = position
        self._array("body_quat")[row] = wxyz
        if first >= 0:
            self._rest(starts, template.counts)
            places = slice(first, first + template.counts["qpos"])
            data.qpos[places] = blocks["qpos0"]
        if spare.free_joint is not None:
            for values in (self._array("qpos0"), self._array("qpos_spring"), data.qpos):
                values[first : first + 3] = position
                values[first + 3 : first + 7] = wxyz
        self._count(starts, template.counts, 1)
        del self._away[row]
        self._weigh()

    def park(self, spare: PooledBody) -> None:
        """Nobody's from now on."""
        spare.owner = -1
        spare.rename(f"{spare.name}/")
        self._put_away(spare.starts, spare.template.counts)

    def park_body(self, built: Built, name: str) -> None:
        """A body of one link is gone; its rows stay for now, under another name."""
        record = built.links[0]
        record.element.name = name
        counts = {"body": 1, "geom": len(record.geoms) + len(record.visuals), "dof": 0, "jnt": 0}
        if built.free_joint is not None:
            built.free_joint.name = name
            counts |= {"dof": 6, "jnt": 1}
        self._put_away(row_starts(self._engine.live_model, record.element.id), counts)

    def _put_away(self, starts: dict[str, int], counts: dict[str, int]) -> None:
        self._rest(starts, counts)
        self._park(starts, counts)
        self._count(starts, counts, -1)
        self._weigh()

    def _park(self, starts: dict[str, int], counts: dict[str, int]) -> None:
        """Out of the way: nothing touches it, no ray meets it, nothing draws it."""
        for name in PARKED_FIELDS:
            self._array(name)[_rows(name[:4], starts, counts)] = 0
        if counts["body"] > 1:
            for name in PARKED_JOINTS:
                self._array(name)[_rows(name[:3], starts, counts)] = 0
        self._away[starts["body"]] = starts, counts

    def _rest(self, starts: dict[str, int], counts: dict[str, int]) -> None:
        """No velocity, nothing that pushes, nothing remembered of the last step."""
        data, dofs = self._engine.live_data, _rows("dof", starts, counts)
        for values in (data.qvel, data.qacc, data.qacc_warmstart, data.qfrc_applied):
            values[dofs] = 0.0
        data.xfrc_applied[_rows("body", starts, counts)] = 0.0

    def _set_masks(self, spare: PooledBody, options: BuildOptions) -> None:
        """Give all that touches anything the masks of a body that has some of its own."""
        assert spare.built is not None
        for name in MASKS:
            block = spare.template.blocks[name]
            mask = options.contype if name.endswith("contype") else options.conaffinity
            rows = _rows(name[:4], spare.starts, spare.template.counts)
            self._array(name)[rows] = np.where(block != 0, mask, 0)
        for geom in (geom for record in spare.built.links for geom in record.geoms):
            geom.contype, geom.conaffinity = options.contype, options.conaffinity

    def _count(self, starts: dict[str, int], counts: dict[str, int], sign: int) -> None:
        row, dofs = starts["body"], counts["dof"]
        masses = self._array("body_mass")
        self._mass += sign * float(
            masses[row] if counts["body"] == 1 else masses[row : row + counts["body"]].sum()
        )
        if dofs:
            self._inertia += sign * float(self._array("dof_M0")[_rows("dof", starts, counts)].sum())
            self._dofs += sign * dofs

    def _weigh(self) -> None:
        """Parked bodies count neither for the mass of the whole world nor for its mean inertia.

        By the latter MuJoCo measures how far its solvers have come.
        """
        self._array("body_subtreemass")[0] = self._mass
        self._engine.live_model.stat.meaninertia = self._inertia / self._dofs if self._dofs else 1.0

    def _array(self, name: str) -> np.ndarray:
        found = self._arrays.get(name)
        if found is None:
            found = self._arrays[name] = getattr(self._engine.live_model, name)
        return found


def is_apart(body: EngineBody, model: Any) -> bool:
    """Whether nothing else in the spec holds on to a body."""
    built = body.built
    if body.description is None or built.equalities or model.ntendon or model.nsensor or model.npair:
        return False
    links = built.links
    if any(record.terrains or record.actuator is not None for record in links):
        return False
    for element in (record.element for record in links):
        if element.sites or element.cameras or element.lights:
            return False
    if len(links) == 1 and links[0].element.bodies:
        return False
    if not model.neq:
        return True
    of_bodies = model.eq_objtype == int(mujoco.mjtObj.mjOBJ_BODY)
    rows = np.stack([model.eq_obj1id, model.eq_obj2id])
    return not bool((of_bodies & np.isin(rows, body.mujoco_ids)).any())


def _rows(kind: str, starts: dict[str, int], counts: dict[str, int]) -> slice:
    """A body's rows in one kind of array."""
    first = starts[kind]
    return slice(first, first + counts[kind]) if first >= 0 else slice(0, 0)


def _write_elements(spare: PooledBody, template: BodyTemplate, *, plainly: bool) -> None:
    """Make a body of one link and its geoms in the spec what a mould says; `plainly`: only numbers differ."""
    pairs = [(spare.element, template.body, spare.template.body)]
    pairs += zip(spare.geoms, template.geoms, spare.template.geoms, strict=True)
    for element, fields, before in pairs:
        for name, value in fields.items():
            if not (plainly and value is before[name]):
                setattr(element, name, value)

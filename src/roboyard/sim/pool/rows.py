"""Rows of MuJoCo's arrays whose owner changes: pooled bodies become bodies, bodies inactive."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.sim.build.bodies import build
from roboyard.sim.build.records import BuildOptions, Built
from roboyard.sim.build.solver_options import scale_tolerance, total_inertia
from roboyard.sim.pool.model_memory import memory_of
from roboyard.sim.pool.templates import BodyTemplate, row_starts, write_elements
from roboyard.sim.protocols import EngineBody, PoolEngine
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim.build.mesh_assets import MeshAssets

MASKS = ("geom_contype", "geom_conaffinity", "body_contype", "body_conaffinity")
INACTIVE_FIELDS = (*MASKS, "geom_rgba")
"""Fields in which an inactive body of one link differs from an active one."""
INACTIVE_JOINTS = ("jnt_limited", "dof_frictionloss")
"""Fields of joints in which it differs, too: inactive joints add no constraints to the solver."""
FEW_USES = 4
"""Bodies that have used a pooled body from which on all its rows are written at once."""
_OF_BODIES, _NONE = int(mujoco.mjtObj.mjOBJ_BODY), np.zeros(0, bool)
_NOWHERE, _UNTURNED = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(kw_only=True, slots=True, eq=False)
class PooledBody:
    """Rows of one body in MuJoCo's arrays, and its elements in the spec."""

    name: str
    """Its name while it is inactive."""
    template: BodyTemplate
    """The template that its elements in the spec agree with."""
    element: Any
    """Of the root link."""
    free_joint: Any
    geoms: list[Any]
    """Of the root link."""
    built: Built | None = None
    """All its elements, if it has several links."""
    owner: int = -1
    """Id of the body that uses it; -1 while it is inactive."""
    is_pristine: bool = True
    """Whether no body has used it yet."""
    is_former: bool = False
    """Whether it was compiled as a body."""
    uses: int = 0
    """Number of bodies that have used it."""
    starts: dict[str, int] = field(default_factory=dict)
    """First row in each kind of array."""
    edits: int = -1
    """Edits of the spec's elements so far when it was used last."""
    places: np.ndarray | None = None
    """Places of all its rows in the memory of MuJoCo's model, once they were looked up."""

    def is_free(self, edits: int) -> bool:
        """Return whether a body can use it.

        One of several links can be used again as long as its elements are known.

        Args:
            edits: of the spec's elements so far.
        """
        return self.owner < 0 and (self.is_pristine or self.built is None or self.edits == edits)

    def rename(self, name: str) -> None:
        """Rename its elements to those of a body whose names have this prefix (ending in "/")."""
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
    """Add a pooled body with the layout of a template to a spec."""
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
    """Writes single bodies into the arrays of a compiled world."""

    def __init__(self, engine: PoolEngine) -> None:
        self._engine = engine
        self._arrays: dict[str, np.ndarray] = {}
        self._memory: np.ndarray | None = None
        """The bytes of the model's arrays, once they were looked for; none where they are not one block."""
        self._structs: tuple[Any, Any, Any] | None = None
        """A model, its statistic and its option, to look up which takes longer than to write a number."""
        self._mass = self._inertia = self._resting = 0.0
        """Mass and inertia of active bodies, inertia of inactive ones."""
        self._dofs = 0
        self._inactive: dict[int, tuple[dict[str, int], dict[str, int], float]] = {}
        """First rows, row counts and inertias of all inactive bodies, by the row of the root."""

    def locate(self, pool: list[PooledBody]) -> None:
        """Look up the rows of pooled bodies after a compile, and make them inactive."""
        model = self._engine.live_model
        self._arrays, self._inactive, self._memory = {}, {}, None
        for slot in pool:
            counts = slot.template.counts
            slot.places = None
            slot.starts = row_starts(model, slot.element.id, counts["body"])
            self._hide(slot.starts, counts)
        self.update_inertia()

    def update_inertia(self) -> None:
        """Sum up masses and inertias after they were written or MuJoCo summed them up."""
        model = self._engine.live_model
        self._mass, self._inertia = float(model.body_mass.sum()), total_inertia(model.dof_M0)
        self._dofs, self._resting = int(model.nv), 0.0
        for starts, counts, _ in list(self._inactive.values()):
            self._count_out(starts, counts)
        if self._inactive:
            self._write_totals()

    def fill(
        self, slot: PooledBody, template: BodyTemplate, options: BuildOptions, position: Array, wxyz: Array
    ) -> None:
        """Turn a pooled body into the body of a template.

        Args:
            slot: inactive, of the template's layout.
            template: the body's numbers.
            options: with the collision masks of the body's geoms.
            position: (3,) of the root link's frame in the world frame (m).
            wxyz: (4,) unit quaternion w, x, y, z of the root link's frame.
        """
        starts, related = slot.starts, slot.is_pristine and slot.template.family is template.family
        if not (related and slot.template is template):
            is_known = slot.edits == self._engine.element_edits  # but for what is written again
            known = slot.template if related or is_known else None
            write_elements(slot.element, slot.geoms, template, known)
            if is_known:
                self._write_again(slot, template)
        slot.element.pos, slot.element.quat = position, wxyz
        blocks, kinds = template.blocks, template.kinds
        if related:
            if slot.template is not template:
                names: Any = (*INACTIVE_FIELDS, *template.varied, *slot.template.varied)
            else:
                names = INACTIVE_FIELDS if slot.built is None else (*INACTIVE_FIELDS, *INACTIVE_JOINTS)
        else:
            # the places of all bytes take longer to find than to write the blocks a few times
            names = () if slot.uses >= FEW_USES and self._write_whole(slot, template) else blocks
        for label in names:
            block, start = blocks[label], starts[kinds[label]]
            self._array(label)[start : start + len(block)] = block
        if slot.built is not None and not (slot.is_pristine and options.contype == template.options.contype):
            self._set_masks(slot, options)
        slot.template, slot.is_pristine, slot.edits = template, False, self._engine.element_edits
        slot.uses += 1
        row, first, data = starts["body"], starts["qpos"], self._engine.live_data
        self._array("body_pos")[row] = position
        self._array("body_quat")[row] = wxyz
        if first >= 0:
            self._rest(starts, template.counts)
            places = slice(first, first + template.counts["qpos"])
            data.qpos[places] = blocks["qpos0"]
        if slot.free_joint is not None:
            for values in (self._array("qpos0"), self._array("qpos_spring"), data.qpos):
                values[first : first + 3] = position
                values[first + 3 : first + 7] = wxyz
        self._add_to_totals(starts, template.counts, 1)
        self._resting -= self._inactive.pop(row)[2]
        self._write_totals()

    def _write_again(self, slot: PooledBody, template: BodyTemplate) -> None:
        """Write a template's coefficients of friction, what depends on them, and no motors into the spec."""
        geoms, blocks = slot.geoms, template.blocks
        if slot.built is not None:
            geoms = [geom for record in slot.built.links for geom in (*record.geoms, *record.visuals)]
            for record in slot.built.links:
                for joint in record.joint_elements:
                    joint.armature = record.motor_inertia
        for geom in geoms:
            place = geom.id - slot.starts["geom"]
            geom.friction, geom.condim = blocks["geom_friction"][place], blocks["geom_condim"][place]

    def former(self, built: Built, template: BodyTemplate, name: str) -> PooledBody:
        """Return a compiled body of several links, whose elements agree with a template, as a pooled one."""
        root = built.links[0]
        starts = row_starts(self._engine.live_model, root.element.id, template.counts["body"])
        return PooledBody(
            name=name,
            template=template,
            element=root.element,
            free_joint=built.free_joint,
            geoms=[*root.geoms, *root.visuals],
            built=built,
            is_pristine=False,
            is_former=True,
            edits=self._engine.element_edits,
            starts=starts,
        )

    def _write_whole(self, slot: PooledBody, template: BodyTemplate) -> bool:
        """Write all rows of a slot at once; return whether MuJoCo's arrays are in one block of memory."""
        memory = self._memory
        if memory is None:
            found = memory_of(self._engine.live_model)
            memory = self._memory = np.zeros(0, np.uint8) if found is None else found
        if not len(memory):
            return False
        places = slot.places
        if places is None:
            start, parts = memory.ctypes.data, list[np.ndarray]()
            for label, block in template.blocks.items():
                values = self._array(label)
                first = values.ctypes.data - start + slot.starts[template.kinds[label]] * values.strides[0]
                parts.append(np.arange(first, first + block.nbytes if len(block) else first))
            places = slot.places = np.concatenate(parts)
        if len(places) != len(template.all_bytes):
            return False
        memory[places] = template.all_bytes
        return True

    def deactivate(self, slot: PooledBody) -> None:
        """Make a body of the pool inactive."""
        slot.owner = -1
        slot.rename(f"{slot.name}/")
        self._deactivate(slot.starts, slot.template.counts)

    def deactivate_body(self, built: Built, name: str) -> None:
        """Make a removed body of one link inactive, under another name."""
        record = built.links[0]
        record.element.name = name
        counts = {"body": 1, "geom": len(record.geoms) + len(record.visuals), "dof": 0, "jnt": 0}
        if built.free_joint is not None:
            built.free_joint.name = name
            counts |= {"dof": 6, "jnt": 1}
        self._deactivate(row_starts(self._engine.live_model, record.element.id), counts)

    def _deactivate(self, starts: dict[str, int], counts: dict[str, int]) -> None:
        self._rest(starts, counts)
        self._hide(starts, counts)
        self._count_out(starts, counts)
        self._write_totals()

    def _hide(self, starts: dict[str, int], counts: dict[str, int]) -> None:
        """Exclude rows from collisions, rays and pictures."""
        for name in INACTIVE_FIELDS:
            self._array(name)[_rows(name[:4], starts, counts)] = 0
        if counts["body"] > 1:
            for name in INACTIVE_JOINTS:
                self._array(name)[_rows(name[:3], starts, counts)] = 0
        self._inactive[starts["body"]] = starts, counts, 0.0

    def _rest(self, starts: dict[str, int], counts: dict[str, int]) -> None:
        """Clear velocities, external forces and the solver's warm start."""
        data, dofs = self._engine.live_data, _rows("dof", starts, counts)
        for values in (data.qvel, data.qacc, data.qacc_warmstart, data.qfrc_applied):
            values[dofs] = 0.0
        data.xfrc_applied[_rows("body", starts, counts)] = 0.0

    def _set_masks(self, slot: PooledBody, options: BuildOptions) -> None:
        """Set the collision masks of all colliding shapes."""
        assert slot.built is not None
        for name in MASKS:
            block = slot.template.blocks[name]
            mask = options.contype if name.endswith("contype") else options.conaffinity
            rows = _rows(name[:4], slot.starts, slot.template.counts)
            self._array(name)[rows] = np.where(block != 0, mask, 0)
        for geom in (geom for record in slot.built.links for geom in record.geoms):
            geom.contype, geom.conaffinity = options.contype, options.conaffinity

    def _count_out(self, starts: dict[str, int], counts: dict[str, int]) -> None:
        """Move an inactive body's share of the totals to those of inactive bodies."""
        inertia = self._add_to_totals(starts, counts, -1)
        self._resting += inertia
        self._inactive[starts["body"]] = starts, counts, inertia

    def _add_to_totals(self, starts: dict[str, int], counts: dict[str, int], sign: int) -> float:
        """Add a body's mass and inertia to the totals, or take them away; return its inertia."""
        row, dofs = starts["body"], counts["dof"]
        masses = self._array("body_mass")
        self._mass += sign * float(
            masses[row] if counts["body"] == 1 else masses[row : row + counts["body"]].sum()
        )
        if not dofs:
            return 0.0
        inertia = total_inertia(self._array("dof_M0")[_rows("dof", starts, counts)])
        self._inertia += sign * inertia
        self._dofs += sign * dofs
        return inertia

    def _write_totals(self) -> None:
        """Write the mass of the world and its mean inertia without inactive bodies.

        MuJoCo measures the convergence of its solvers by the mean inertia, or by the inertia of all bodies.
        """
        self._array("body_subtreemass")[0] = self._mass
        model = self._engine.live_model
        if self._structs is None or self._structs[0] is not model:
            self._structs = model, model.stat, model.opt
        _, statistic, option = self._structs
        is_there = self._dofs > 0 and self._inertia > 0.0
        statistic.meaninertia = self._inertia / self._dofs if is_there else 1.0
        scale_tolerance(option, self._inertia / (self._inertia + self._resting) if is_there else 1.0)

    def _array(self, name: str) -> np.ndarray:
        found = self._arrays.get(name)
        if found is None:
            found = self._arrays[name] = getattr(self._engine.live_model, name)
        return found


def is_apart(body: EngineBody, model: Any) -> bool:
    """Return whether no other element of the spec refers to a body."""
    built = body.built
    if body.description is None or built.equalities or model.ntendon or model.nsensor or model.npair:
        return False
    links = built.links
    if any(record.terrains or record.windows or record.actuator is not None for record in links):
        return False
    if model.nsite or model.ncam or model.nlight:
        for element in (record.element for record in links):
            if element.sites or element.cameras or element.lights:
                return False
    if len(links) == 1 and links[0].element.bodies:
        return False
    of_bodies = model.eq_objtype == _OF_BODIES if model.neq else _NONE
    if not of_bodies.any():
        return True
    rows = np.stack([model.eq_obj1id, model.eq_obj2id])
    return not bool((of_bodies & np.isin(rows, body.mujoco_ids)).any())


def _rows(kind: str, starts: dict[str, int], counts: dict[str, int]) -> slice:
    """Return a body's rows in one kind of array."""
    first = starts[kind]
    return slice(first, first + counts[kind]) if first >= 0 else slice(0, 0)

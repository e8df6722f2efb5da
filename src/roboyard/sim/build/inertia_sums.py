"""Sums that MuJoCo computes of masses, computed again for free bodies alone whose mass has changed.

`mj_setConst` computes them for all bodies, which takes longer than a step of a few robots.
"""

from __future__ import annotations

from typing import Any

from roboyard._mujoco import mujoco
from roboyard.native import compiled

_TRACKING = int(mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM)


class InertiaSums:
    """Which masses MuJoCo's sums are of."""

    def __init__(self) -> None:
        """Start without any."""
        self._of: tuple[Any, int] | None = None
        self._arguments: tuple[Any, ...] = ()

    def note(self, model: Any, revision: int) -> None:
        """Note that all sums are those of the present masses.

        Args:
            model: MjModel.
            revision: changes with the bodies that have rows in it.
        """
        depends_on_masses = model.ntendon or model.nu or model.nflex
        if depends_on_masses or (model.cam_mode == _TRACKING).any() or (model.light_mode == _TRACKING).any():
            self._of = None
            return
        self._of = model, revision
        self._arguments = (
            *(model.body_mass.copy(), model.body_inertia.copy(), model.body_mass, model.body_inertia),
            *(model.body_parentid, model.body_jntadr, model.body_dofadr, model.body_dofnum, model.jnt_type),
            *(model.body_ipos, model.body_iquat, model.dof_armature, model.body_gravcomp),
            *(model.body_subtreemass, model.dof_M0, model.dof_invweight0, model.body_invweight0),
        )

    def update(self, model: Any, revision: int) -> bool:
        """Compute the sums of what has changed since; return False, without effect, where it may be more."""
        if self._of is None or self._of[0] is not model or self._of[1] != revision:
            return False
        return bool(sum_free_bodies(*self._arguments, model.ngravcomp))


@compiled(
    "f8[:] f8[:,:] f8[:] f8[:,:] i4[:] i4[:] i4[:] i4[:] i4[:]"
    " f8[:,:] f8[:,:] f8[:] f8[:] f8[:] f8[:] f8[:] f8[:,:] i8 -> i8"
)
def sum_free_bodies(
    known_mass, known_inertia, mass, inertia, parents, joints, dofs, counts, kinds,
    positions, turns, armature, gravcomp, subtrees, of_dofs, dof_weights, weights, floating,
):  # pragma: no cover  # fmt: skip
    """Sum up changed masses of free bodies of one link about their frames; return 0 where others changed.

    known_mass, known_inertia: (n,) and (n, 3) of the sums, written. mass, inertia: the present ones (kg,
    kg m²). parents, joints, dofs, counts: (n,) of bodies. kinds: (j,) of joints. positions, turns: (n, 3) and
    (n, 4) of centres of mass. armature: (nv,). gravcomp: (n,). subtrees: (n,) masses, written, as are
    of_dofs: (nv,) inertia, dof_weights: (nv,) and weights: (n, 2) inverse inertia. floating: number of bodies
    with a share of gravity less than 1 for all MuJoCo knows; more than there are is no harm. Returns 1 else.
    """
    bodies = len(mass)
    for k in range(1, bodies):
        if floating == 0 and gravcomp[k] != 0.0:
            return 0
        if parents[k] > 0 and _differs(known_mass, known_inertia, mass, inertia, parents[k]):
            return 0
        if not _differs(known_mass, known_inertia, mass, inertia, k):
            continue
        if parents[k] != 0 or counts[k] != 6 or kinds[joints[k]] != 0 or not mass[k] > 0.0:
            return 0
        if not min(inertia[k, 0], inertia[k, 1], inertia[k, 2]) > 0.0 or turns[k, 0] != 1.0:
            return 0
        for axis in range(3):
            if positions[k, axis] != 0.0 or turns[k, 1 + axis] != 0.0:
                return 0
        for dof in range(dofs[k], dofs[k] + 6):
            if armature[dof] != 0.0:
                return 0
    for k in range(bodies):
        subtrees[k] = mass[k]
        if k == 0 or not _differs(known_mass, known_inertia, mass, inertia, k):
            continue
        first, inverse = dofs[k], 1.0 / mass[k]
        known_mass[k], weights[k, 0] = mass[k], (inverse + inverse + inverse) / 3.0
        total = 0.0
        for axis in range(3):
            known_inertia[k, axis] = of_dofs[first + 3 + axis] = inertia[k, axis]
            of_dofs[first + axis] = mass[k]
            total += 1.0 / inertia[k, axis]
        weights[k, 1] = total / 3.0
        for axis in range(3):
            dof_weights[first + axis], dof_weights[first + 3 + axis] = weights[k, 0], weights[k, 1]
    for k in range(bodies - 1, 0, -1):
        subtrees[parents[k]] += subtrees[k]
    return 1


def _differs(known_mass, known_inertia, mass, inertia, k):  # pragma: no cover
    """Return whether the mass or a moment of a body is another than before."""
    return (
        mass[k] != known_mass[k]
        or inertia[k, 0] != known_inertia[k, 0]
        or inertia[k, 1] != known_inertia[k, 1]
        or inertia[k, 2] != known_inertia[k, 2]
    )

"""Compiled loops over MuJoCo's arrays, run between the two halves of a step. Import on first use only."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def add_damping(damping, mass, inertia, rootid, cvel, xipos, ximat, subtree_com, xfrc):  # pragma: no cover
    """Add drag to xfrc: force -m v (k + q |v|) at the centre of mass, torque -I w (k + q |w|).

    damping: (nbody, 4) linear k (1/s), linear q (1/m), angular k (1/s), angular q (-).
    cvel: (nbody, 6) angular, then linear velocity at the tree's centre of mass, world axes.
    """
    for b in range(1, mass.shape[0]):
        kl, ql, ka, qa = damping[b, 0], damping[b, 1], damping[b, 2], damping[b, 3]
        if kl == 0.0 and ql == 0.0 and ka == 0.0 and qa == 0.0:
            continue
        c = rootid[b]
        wx, wy, wz = cvel[b, 0], cvel[b, 1], cvel[b, 2]
        rx = xipos[b, 0] - subtree_com[c, 0]
        ry = xipos[b, 1] - subtree_com[c, 1]
        rz = xipos[b, 2] - subtree_com[c, 2]
        vx = cvel[b, 3] + wy * rz - wz * ry
        vy = cvel[b, 4] + wz * rx - wx * rz
        vz = cvel[b, 5] + wx * ry - wy * rx
        f = -mass[b] * (kl + ql * np.sqrt(vx * vx + vy * vy + vz * vz))
        xfrc[b, 0] += f * vx
        xfrc[b, 1] += f * vy
        xfrc[b, 2] += f * vz
        t = -(ka + qa * np.sqrt(wx * wx + wy * wy + wz * wz))
        m = ximat[b]
        for k in range(3):
            along = m[k] * wx + m[3 + k] * wy + m[6 + k] * wz
            moment = t * inertia[b, k] * along
            xfrc[b, 3] += moment * m[k]
            xfrc[b, 4] += moment * m[3 + k]
            xfrc[b, 5] += moment * m[6 + k]


@njit(cache=True)
def add_bounce(restitution, geom, address, velocity, timestep, slow, aref):  # pragma: no cover
    """Raise the reference acceleration of closing contacts so that they part at e times their speed.

    restitution: (ngeom,); a pair's coefficient is the product. geom: (ncon, 2). address: (ncon,) row of the
    contact's normal in the constraint arrays, -1 for none. slow: m/s below which nothing bounces.
    """
    for i in range(geom.shape[0]):
        a, b, row = geom[i, 0], geom[i, 1], address[i]
        if a < 0 or b < 0 or row < 0:
            continue
        e = restitution[a] * restitution[b]
        if e > 0.0 and velocity[row] < -slow:
            wanted = -(1.0 + e) * velocity[row] / timestep
            aref[row] = max(aref[row], wanted)

"""Which links count as fixed to each other where contacts are found."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.impulses.records import MECHANISM


@compiled(MECHANISM, "i4[::1] i4[::1] i4[:,::1] -> i8")
def touching_welds(mechanism, fixed_to, freedoms, found):  # pragma: no cover
    """Write the bodies that count as fixed to each other, and which of them each geom belongs to.

    MuJoCo looks for no contacts of bodies that are fixed to the same one, nor of two without degrees of
    freedom. Here links of a robot that touch one another count as bodies of their own, also where they cannot
    move apart, but for those that are fixed to the world.

    fixed_to, freedoms: (nbody,) MuJoCo's `body_weldid` and `body_dofnum`. found: (2, nbody) written, the same
    as they are here. `mechanism.geom_weld` is written too. Returns whether these are not MuJoCo's own.
    """
    for body in range(fixed_to.shape[0]):
        found[0, body], found[1, body] = fixed_to[body], freedoms[body]
    differs = 0
    for geom in range(mechanism.geom_body.shape[0]):
        body = mechanism.geom_body[geom]
        weld = fixed_to[body]
        if weld != 0 and weld != body and mechanism.contype[geom] & mechanism.conaffinity[geom] != 0:
            found[0, body], found[1, body] = body, 1
            differs = 1
    for geom in range(mechanism.geom_body.shape[0]):
        mechanism.geom_weld[geom] = found[0, mechanism.geom_body[geom]]
    return differs

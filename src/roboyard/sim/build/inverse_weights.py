"""Bound the softness of contacts from below where MuJoCo takes a link for immovable.

MuJoCo makes a contact as soft as the inverse weights of its two bodies, taken at their centres of mass.
A link that turns about an axis through its own centre of mass (the first joints of a finger) has no inverse
weight there, although every other point of it moves. Between two such links a contact becomes a constraint
of stiffness 1e15, on which the solver diverges.
"""

from __future__ import annotations

from roboyard._mujoco import mujoco
from roboyard.native import compiled

SHARE = 0.1
"""Least inverse weight, as a share of the one at the link's smallest radius of gyration."""


def bound_inverse_weights(model: mujoco.MjModel) -> None:
    """Raise the inverse weights (1/kg) of links that turn about their centre of mass; edits the model.

    The bound is `SHARE` times inverse inertia times the square of the smallest radius of gyration. A free
    body of any shape is at least ten times above it.
    """
    raise_weights(model.body_mass, model.body_inertia, model.body_invweight0, SHARE)


@compiled("f8[:] f8[:,:] f8[:,:] f8")
def raise_weights(mass, inertia, weights, share):  # pragma: no cover
    """Raise the first of each body's two weights to a share of the second times inertia over mass.

    mass: (n,) kg. inertia: (n, 3) kg m². weights: (n, 2) 1/kg and 1/(kg m²).
    """
    for k in range(len(mass)):
        if mass[k] > 0.0:
            least = min(inertia[k, 0], inertia[k, 1], inertia[k, 2])
            weights[k, 0] = max(weights[k, 0], share * weights[k, 1] * (least / mass[k]))

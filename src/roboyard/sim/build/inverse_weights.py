"""Bound the softness of contacts from below where MuJoCo takes a link for immovable.

MuJoCo makes a contact as soft as the inverse weights of its two bodies, taken at their centres of mass.
A link that turns about an axis through its own centre of mass (the first joints of a finger) has no inverse
weight there, although every other point of it moves. Between two such links a contact becomes a constraint
of stiffness 1e15, on which the solver diverges.
"""

from __future__ import annotations

import numpy as np

from roboyard._mujoco import mujoco

SHARE = 0.1
"""Least inverse weight, as a share of the one at the link's smallest radius of gyration."""


def bound_inverse_weights(model: mujoco.MjModel) -> None:
    """Raise the inverse weights (1/kg) of links that turn about their centre of mass; edits the model.

    The bound is `SHARE` times inverse inertia times the square of the smallest radius of gyration. A free
    body of any shape is at least ten times above it.
    """
    mass, weights = model.body_mass, model.body_invweight0
    radius = np.divide(model.body_inertia.min(axis=1), mass, out=np.zeros_like(mass), where=mass > 0.0)
    weights[:, 0] = np.maximum(weights[:, 0], SHARE * weights[:, 1] * radius)

"""Softness of contacts of links that turn about their own centre of mass."""

import mujoco
import numpy as np

from roboyard.sim.build.inverse_weights import SHARE, bound_inverse_weights

TWO_ROTORS = """
<mujoco>
  <option timestep="0.004"/>
  <worldbody>
    <body name="left"><joint name="left" axis="0 0 1"/>
      <geom type="box" size="0.03 0.01 0.01" mass="0.05"/></body>
    <body name="right" pos="0.045 0 0"><joint name="right" axis="0 0 1"/>
      <geom type="box" size="0.03 0.01 0.01" mass="0.05" quat="0.9 0 0 0.4359"/></body>
    <body name="rod" pos="0 0 1"><freejoint/>
      <geom type="capsule" size="0.001 0.5" mass="0.1"/></body>
  </worldbody>
</mujoco>
"""


def test_a_contact_of_two_rotors_is_not_infinitely_stiff() -> None:
    """Their centres of mass do not move, so that MuJoCo alone makes the contact of stiffness 1e15."""
    model = mujoco.MjModel.from_xml_string(TWO_ROTORS)
    assert stiffest(model) > 1e12
    bound_inverse_weights(model)
    assert stiffest(model) < 1e6
    left = model.body("left")
    inertia = 0.05 / 3 * np.array([0.01**2 + 0.01**2, 0.03**2 + 0.01**2])  # least, and about the axis
    turning = 1.0 / 3.0 / inertia[1]  # MuJoCo's is a mean over three axes, of which one turns
    weight = SHARE * turning * inertia[0] / 0.05
    np.testing.assert_allclose(left.invweight0[0], weight, rtol=1e-6)


def test_free_bodies_keep_their_inverse_weight() -> None:
    """A rod 500 times as long as thick, the worst case, keeps the inverse of its mass."""
    model = mujoco.MjModel.from_xml_string(TWO_ROTORS)
    bound_inverse_weights(model)
    np.testing.assert_allclose(model.body("rod").invweight0[0], 10.0, rtol=1e-6)


def stiffest(model: mujoco.MjModel) -> float:
    """Return the largest stiffness of a constraint row (kg) where the rotors touch."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon > 0
    return float(data.efc_D.max())

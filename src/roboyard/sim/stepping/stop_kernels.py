"""Compiled loops over joint limits, run after a step that carried a joint through its stop."""

from __future__ import annotations

from roboyard.native import compiled

BEYOND = 0.003
"""Distance beyond a stop (rad or m) from which a moving joint has passed it; stops are soft by less."""
MOVING = 0.2
"""Speed away from its range (rad/s or m/s) above which a joint moves; its soft stop brakes slower ones."""
CORRECTION = 0.2
"""Share of the distance beyond a stop that is corrected in a step."""
LEAST_RESPONSE = 0.05
"""Bound on the measured share of a requested change of velocity that a step makes."""


@compiled("i8[:] f8[:,:] i4[:] i4[:] f8[:] f8[:] f8[:] f8 u1[:] f8[:] f8[:] -> f8")
def passed_stops(  # pragma: no cover
    joints, limits, qpos_places, dof_places, before, qpos, qvel, timestep, side, free, ask
):
    """Note the joints that are beyond their stops and move on, and what velocity to ask of each.

    A noted joint that is still beyond got less than it was asked for: drives are integrated implicitly, with
    more inertia than constraints are solved for. The share that it got gives the next request.

    joints: (n,) those with limits. limits: (njnt, 2) lower and upper. before: (nq,) earlier positions.
    side: (njnt,) 1 for a lower stop, 2 for an upper one, else 0, written. free, ask: (njnt,) velocity after
    the step without the stop, and the requested one, written. Returns the number of joints beyond.
    """
    count = 0.0
    for k in range(joints.shape[0]):
        j = joints[k]
        q, v = qpos[qpos_places[j]], qvel[dof_places[j]]
        below = q < limits[j, 0] - BEYOND and v < -MOVING
        above = q > limits[j, 1] + BEYOND and v > MOVING
        if not (below or above):
            continue
        count += 1.0
        way = (limits[j, 0] if below else limits[j, 1]) - before[qpos_places[j]]
        is_within = way <= 0.0 if below else way >= 0.0
        wanted = way / timestep if is_within else CORRECTION * way / timestep
        if side[j] == 0:
            side[j] = 1 if below else 2
            free[j], ask[j] = v, wanted
        else:
            got = (v - free[j]) / (ask[j] - free[j]) if ask[j] != free[j] else 1.0
            ask[j] = free[j] + (wanted - free[j]) / min(max(got, LEAST_RESPONSE), 1.0)
    return count


@compiled("i4[:] i4[:] f8[:] f8[:] i8 i8 f8 f8[:,:] i4[:] f8[:] u1[:] f8[:] f8[:]")
def approach_stops(  # pragma: no cover
    kind, owner, position, velocity, first, count, timestep, limits, qpos_places, qpos, side, ask, aref
):
    """Write reference accelerations of the limits of noted joints: the velocity asked for at the stop, and
    none but v' >= -position / dt at the other end of the range.

    kind, owner: type and joint of each constraint row; rows first ... first + count are limits, 3 for those
    of hinges and sliders. position: distance to the limit (rad or m), negative beyond it.
    """
    for row in range(first, first + count):
        j = owner[row]
        if kind[row] != 3 or side[j] == 0:
            continue
        q = qpos[qpos_places[j]]
        is_lower = abs(q - limits[j, 0] - position[row]) < abs(limits[j, 1] - q - position[row])
        wanted = -position[row] / timestep
        if is_lower and side[j] == 1:
            wanted = ask[j]
        elif not is_lower and side[j] == 2:
            wanted = -ask[j]
        aref[row] = (wanted - velocity[row]) / timestep

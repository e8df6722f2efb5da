"""Compiled loops over joint limits, run after a step that carried a joint through its stop."""

from __future__ import annotations

from roboyard.native import compiled

BEYOND = 0.003
"""Distance beyond a stop (rad or m) from which a moving joint has passed it; stops are soft by less."""
MOVING = 0.2
"""Speed away from its range (rad/s or m/s) above which a joint moves; its soft stop brakes slower ones."""
CORRECTION = 0.2
"""Share of the distance beyond a stop that is corrected in a step."""
THROWN = 0.5
"""Speed into its range (rad/s or m/s) above which a joint was thrown back by its stop."""
LEAST_RESPONSE = 0.05
"""Bound on the measured share of a requested change of velocity that a step makes."""


@compiled("i8[:] f8[:,:] i4[:] i4[:] f8[:] f8[:] f8[:] f8 u1[:] f8[:] f8[:,:] -> f8")
def passed_stops(  # pragma: no cover
    joints, limits, qpos_places, dof_places, before, qpos, qvel, timestep, side, ask, bracket
):
    """Note the joints that are beyond their stops and move on, and what velocity to ask of each.

    A noted joint that is still beyond got less than it was asked for: drives are integrated implicitly, with
    more inertia than constraints are solved for, and other rows hold against it. The share that it got gives
    the next request. One that is thrown back got more: a stop only stops, so the request is interpolated.

    joints: (n,) those with limits. limits: (njnt, 2) lower and upper. before: (nq,) earlier positions.
    side: (njnt,) 1 for a lower stop, 2 for an upper one, else 0, written. ask: (njnt,) the requested velocity
    after the step, written. bracket: (njnt, 5) velocity without the stop, and request and velocity of the
    last attempt that was too weak and of the last that was too strong, written; all inwards. Returns the
    number of joints beyond or thrown back.
    """
    count = 0.0
    for k in range(joints.shape[0]):
        j = joints[k]
        q, v = qpos[qpos_places[j]], qvel[dof_places[j]]
        below = q < limits[j, 0] - BEYOND and v < -MOVING
        above = q > limits[j, 1] + BEYOND and v > MOVING
        is_beyond = below or above
        if not is_beyond and side[j] == 0:
            continue
        is_lower = below or (not above and side[j] == 1)
        inwards = 1.0 if is_lower else -1.0
        way = inwards * ((limits[j, 0] if is_lower else limits[j, 1]) - before[qpos_places[j]])
        wanted = way / timestep if way <= 0.0 else CORRECTION * way / timestep
        speed, asked = inwards * v, inwards * ask[j]
        seen = bracket[j]
        if is_beyond and side[j] != (1 if is_lower else 2):
            side[j] = 1 if is_lower else 2
            seen[0] = seen[1] = seen[2] = speed
            seen[3] = -1e300
            ask[j] = inwards * wanted
            count += 1.0
            continue
        if is_beyond:
            seen[1], seen[2] = asked, speed
            if seen[3] < asked:
                got = (speed - seen[0]) / (asked - seen[0]) if asked != seen[0] else 1.0
                ask[j] = inwards * (seen[0] + (wanted - seen[0]) / min(max(got, LEAST_RESPONSE), 1.0))
                count += 1.0
                continue
        elif asked > wanted + MOVING and speed > max(wanted, 0.0) + THROWN:
            seen[3], seen[4] = asked, speed
        else:
            continue
        count += 1.0
        rise = seen[4] - seen[2]
        share = (wanted - seen[2]) / rise if rise > 0.0 else 0.5
        ask[j] = inwards * (seen[1] + min(max(share, 0.1), 0.9) * (seen[3] - seen[1]))
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

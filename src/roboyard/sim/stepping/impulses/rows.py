"""Rows of constraints in the order in which an impulse solver takes them, and what they ask for."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.entries import along

LEAST_FRICTION = 1e-5
"""MuJoCo's smallest coefficient of friction, which contacts without friction have there."""
LARGEST_LIMIT_IMPULSE = 100.0
"""Bullet's bound on the impulse of a joint limit in a step (N m s or N s)."""


def choose_trees(
    kind, index, geom, address, geom_tree, dof_tree, joint_dof, joint_type, slot, limit_slot, equality_tree,
    count, taken,
):  # fmt: skip
    """Choose the kinematic trees to solve: all that touch anything, so that no other solver is needed.

    Where soft bodies touch something, choose those with motors, equalities or exceeded joint limits, and what
    touches them.

    kind, index: type and dof, joint or equality of each constraint row; rows 0 ... count are equalities,
    dry friction (the motors) and limits. geom: (ncon, 2). address: (ncon,) first row of each contact, -1
    for none. geom_tree: (ngeom,) tree, -1 for what is fixed. slot, limit_slot: (nv,) place of each motor
    and limit, -1 for none. equality_tree: (neq, 2), -1 for what is fixed, -2 for an equality of another
    solver. taken: (ntree,) 1 for the chosen trees, written. Returns False where a row is of another kind,
    or a chosen tree touches a soft body.
    """
    for tree in range(taken.shape[0]):
        taken[tree] = 0
    for row in range(count):
        if kind[row] == 1 and slot[index[row]] >= 0:
            taken[dof_tree[index[row]]] = 1
        elif kind[row] == 3 and joint_type[index[row]] >= 2 and limit_slot[joint_dof[index[row]]] >= 0:
            taken[dof_tree[joint_dof[index[row]]]] = 1
        elif kind[row] == 0 and equality_tree[index[row], 0] > -2:
            for side in range(2):
                if equality_tree[index[row], side] >= 0:
                    taken[equality_tree[index[row], side]] = 1
        else:
            return False
    softness = 0
    for i in range(geom.shape[0]):
        if address[i] >= 0 and (geom[i, 0] < 0 or geom[i, 1] < 0):
            softness += 1
    if softness == 0:
        for i in range(geom.shape[0]):
            if address[i] >= 0:
                for side in range(2):
                    if geom_tree[geom[i, side]] >= 0:
                        taken[geom_tree[geom[i, side]]] = 1
        return True
    grows = True
    while grows:
        grows = False
        for i in range(geom.shape[0]):
            if address[i] < 0:
                continue
            if geom[i, 0] < 0 or geom[i, 1] < 0:
                continue
            a, b = geom_tree[geom[i, 0]], geom_tree[geom[i, 1]]
            if a >= 0 and b >= 0 and taken[a] != taken[b]:
                taken[a] = taken[b] = 1
                grows = True
    for i in range(geom.shape[0]):  # soft bodies touch none of these
        if address[i] >= 0 and (geom[i, 0] < 0 or geom[i, 1] < 0):
            for side in range(2):
                tree = geom_tree[geom[i, side]] if geom[i, side] >= 0 else -1
                if tree >= 0 and taken[tree] == 1:
                    return False
    return True


def order_rows(
    kind, index, geom, address, dim, geom_tree, dof_tree, joint_dof, joint_qpos, qpos, slot, limit_slot,
    limits, equality_slot, equality_tree, taken, count, sequence, listed, places, rows, ends,
):  # fmt: skip
    """List the rows of the chosen trees in the order of solution.

    Motors, limits and equalities come by their places, then the normals of all contacts, their spinning
    rows, the pairs of their rolling rows, the pairs of their sliding rows. limits: (njnt, 2). sequence: the
    contacts in the order of solution, of which there are `listed`. places: work array. rows: (n, 4) row, its
    trees (-1 for none) and the contact's place in the list of normals (-1 for none), written. ends: (5,) ends
    of the five groups, written. Returns the number of rows.
    """
    for place in range(places.shape[0]):
        places[place] = -1
    for row in range(count):
        if kind[row] == 0:
            place = equality_slot[index[row]]
            while places[place] >= 0:
                place += 1
            places[place] = row
            continue
        dof = index[row] if kind[row] == 1 else joint_dof[index[row]]
        if taken[dof_tree[dof]] == 0:
            continue
        if kind[row] == 1:
            places[slot[dof]] = row
        else:
            joint = index[row]
            q = qpos[joint_qpos[joint]]
            upper = limits[joint, 1] - q < q - limits[joint, 0]
            place = limit_slot[dof] + (1 if upper else 0)
            if places[place] >= 0:
                place = 2 * limit_slot[dof] + 1 - place
            places[place] = row
    n = 0
    for place in range(places.shape[0]):
        row = places[place]
        if row >= 0 and kind[row] == 0:
            a, b = equality_tree[index[row], 0], equality_tree[index[row], 1]
            rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3] = row, a, -1 if b == a else b, -1
            n += 1
        elif row >= 0:
            dof = index[row] if kind[row] == 1 else joint_dof[index[row]]
            rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3] = row, dof_tree[dof], -1, -1
            n += 1
    ends[0] = n
    for group in range(4):
        normal = ends[0]
        for k in range(listed):
            i = sequence[k]
            if address[i] < 0:
                continue
            a, b = geom_tree[geom[i, 0]], geom_tree[geom[i, 1]]
            if not ((a >= 0 and taken[a] == 1) or (b >= 0 and taken[b] == 1)):
                continue
            if b == a:
                b = -1
            first, size = 0, 1
            if group == 1:
                first = 3
                size = 1 if dim[i] > 3 else 0
            elif group == 2:
                first = 4
                size = 2 if dim[i] > 5 else 0
            elif group == 3:
                first = 1
                size = 2 if dim[i] > 2 else 0
            for k in range(size):
                rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3] = address[i] + first + k, a, b, normal
                n += 1
            normal += 1
        ends[group + 1] = n
    return n


def contact_rows(geom, address, dim, friction, compliance, restitution, R, mu, soft):
    """Write the coefficients of contacts' friction rows, the bounce and the compliance of their normals.

    friction: (ncon, 5). compliance: (ngeom, 2) stiffness, 0 for a rigid surface, and damping. restitution:
    (ngeom,). R: (nefc,). mu, soft: (nefc,) or more, written; mu of a normal is its coefficient of
    restitution, soft in m/s by N s, 0 for rigid contacts.
    """
    for i in range(address.shape[0]):
        row = address[i]
        if row < 0 or geom[i, 0] < 0 or geom[i, 1] < 0:
            continue
        soft[row] = 0.0
        mu[row] = restitution[geom[i, 0]] * restitution[geom[i, 1]]
        if compliance[geom[i, 0], 0] > 0.0 or compliance[geom[i, 1], 0] > 0.0:
            soft[row] = R[row]
        for k in range(1, dim[i]):
            mu[row + k] = friction[i, k - 1] if friction[i, k - 1] > LEAST_FRICTION else 0.0


def set_goals(
    rows, kind, index, position, velocity, aref, base, loss, mu, soft, dof_joint, joint_type, joint_qpos,
    motors, targets, qpos, qvel, smooth, spans, jacobian, ends, bounds, shares, aux, erp, slow, timestep,
    goals,
):  # fmt: skip
    """Write what each row asks for: change of velocity, least and largest impulse, impulse 0,
    compliance, and 0 for `note_gears`.

    A motor asks for v' = kp (q* - q) / dt + v + kd (v* - v) with v the velocity that forces alone lead to,
    limits and normals for at least their reference, friction for none, equalities for a share of their
    position's error (nefc,) in a step. base: (nefc,) references of normals without the correction for
    sliding, with bounces from the present velocity, in whose place comes the one that forces alone lead to.
    Of sliding rows base is the velocity. slow: closing speed (m/s) below which nothing bounces. loss: (nefc,)
    bounds of motors. mu: (nefc,) coefficients of friction rows, and of the restitution of normals. smooth:
    (nv,) accelerations by forces alone. soft: (nefc,) compliance of normals. spans, jacobian: of the rows
    listed. bounds: (neq, 2) largest forces of an equality's rows, the last three of a weld's apart. shares:
    (neq,) of `erp`. aux: (neq,) dof whose velocity a gear follows, -1 for none. goals: (n, 6),
    written.
    """
    for n in range(ends[4]):
        row = rows[n, 0]
        speed = velocity[row] + timestep * along(jacobian, n, spans, smooth)
        low, high, goal = 0.0, 1e10, 0.0
        goals[n, 4] = soft[row] if ends[0] <= n < ends[1] else 0.0
        if n >= ends[1]:
            low = high = mu[row]
            if n >= ends[3]:
                goal = base[row]
        elif n >= ends[0]:
            goal = velocity[row] + timestep * base[row]
            if speed < -slow:
                goal -= mu[row] * speed
            if velocity[row] < -slow:
                goal += mu[row] * velocity[row]
        elif kind[row] == 3:
            goal = velocity[row] + timestep * aref[row]
            high = LARGEST_LIMIT_IMPULSE
        elif kind[row] == 0:
            equality = index[row]
            is_angle = row >= 3 and kind[row - 3] == 0 and index[row - 3] == equality
            high = bounds[equality, 1 if is_angle else 0] * timestep
            low = -high
            goal = -shares[equality] * erp * position[row] / timestep
            if aux[equality] >= 0:
                goal += qvel[aux[equality]] + timestep * smooth[aux[equality]]
        else:
            dof = index[row]
            joint = dof_joint[dof]
            high = loss[row] * timestep
            low = -high
            if joint_type[joint] >= 2:
                goal = speed + motors[dof, 3] * (motors[dof, 2] - speed)
                if motors[dof, 0] >= 2.0:
                    goal += motors[dof, 1] * (targets[dof, 0] - qpos[joint_qpos[joint]]) / timestep
                largest = motors[dof, 4]
                if largest > 0.0:
                    goal = min(max(goal, -largest), largest)
            else:
                goal = qvel[dof] + timestep * aref[row]
        goals[n, 0], goals[n, 1], goals[n, 2], goals[n, 3] = goal - speed, low, high, 0.0
        goals[n, 5] = 0.0

"""Arrays that the solver of rows in turn works on, as arguments of compiled loops."""

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native import Bundle, record
from roboyard.sim.stepping.narrow_phase.field_kernels import FIELDS
from roboyard.sim.stepping.step_row_kernels import CONTACTS, ROWS

(
    TIMESTEP,
    ERP,
    CONTACT_ERP,
    DEEP,
    SLOW,
    RESIDUAL,
    ROUNDS,
    IS_PRODUCT,
    IS_COMPLIANT,
    LIMITS_ARE_HARD,
    CONTACTS_ARE_HARD,
    KEEPS_POINTS,
    SEEN,
    IS_BOUNDED,
    SLOP,
    BY_ENTRY,
    IS_PYRAMID,
    RULES,
) = range(18)
"""Places in `Solver.rules`."""
WISH, INVERSE, LOW, HIGH, IMPULSE, OWN, CUT, LINES = range(8)
"""Lines of `Solver.lines`, each of as many numbers as there are rows, rounded up to blocks."""
(
    PAIRS, TABLE, EXTRA, HELD, LISTED, RANKED, CHECKED, FULL, RENUMBERED, SORTED, TAKEN_UP, SHAPES, REFRESHED,
    ORDERED, LINKS, STEPS, GIVEN, NOTES,
) = range(18)  # fmt: skip
"""Places in `Points.notes`."""
PART_KIND, PART_INDEX, PART_SIZE, PART_TREE, PART_RANK, PART_GROUP, PART_START, PART_END, PART = range(9)
"""Rows of `Mechanism.parts`: kind, first degree of freedom or equality, number of rows of a motor, tree; then
those that `order_parts` sorts: numbers of the parts, their groups, and ends of ranges to be sorted."""
LIMIT, MOTOR, EQUALITY = range(3)
"""Kinds of parts."""
HIDDEN = -2
"""In place of a rank: of two links of a body that never touch, but are a pair in Bullet's broad phase."""
RANK, GROUP, HEAD, RANGE_START, RANGE_END, ONE, TWO, WORK = range(8)
"""Rows of `Points.work`: ranks and the groups of their pairs, as they are sorted; the first contact in the
order of solution at each rank; ends of ranges to be sorted; turns in which links entered the broad phase."""
NODES_OF_PARTS = 6
"""Numbers in `Points.stack` of each pair of nodes that `rank_pair` has yet to visit."""
HALF_TURN = -2
"""In place of a contact's place in the list of normals: of a row of an equality that is for half a turn."""
EQUALITY_ROWS = 6
"""Most rows of an equality."""
DENSE = 128
"""Most rows whose effects on each other are kept as a table; more are solved without one."""
FEW, SHORT = 24, 8
"""Rows of less than `SHORT` entries on average are solved without a table if they are more than `FEW`."""
BLOCK = 8
"""Numbers of rows are rounded up to a multiple of it, so that loops over them have no rest."""
WITHOUT_CONTACTS = 2
"""Where the Jacobian has no rows of contacts; see `Search.is_sparse`."""
ROWS_OF_CONTACT = 6
"""Most rows of a contact."""
KEEP, MAKE, ARRANGE, ASK, SOLVE = range(5)
"""Parts of a step, in order."""
OF_NONE, OF_CONTACTS, OF_ALL = range(3)
"""Which rows are made here instead of by MuJoCo."""
DONE, ROOM, ROOM_FOR_ROWS, POINTS_ARE_NEW, ROWS_ARE_OLD, OTHERS, LOST = range(7)
"""Answers of `execute`: all is done; arrays are too short, those of points, too, or of rows after points were
kept; points must be added to MuJoCo's contacts; it must make rows again, since contacts were moved or added;
its solver has rows to solve; its arrays are not where they were."""


class Search(NamedTuple):
    """Where the arrays of a step's contacts and rows are looked for; see `find_rows`."""

    words: np.ndarray
    places: np.ndarray
    """Empty where the arrays are passed instead."""
    counts: np.ndarray
    """(6,) numbers of contacts, of rows (equalities, dry friction, limits, all), of Jacobian entries."""
    starts: np.ndarray
    address: int
    size: int
    contact: int
    degrees: int
    is_sparse: int
    """1 where the Jacobian has only some entries of each row, `WITHOUT_CONTACTS` where it has some entries of
    each row of joints and equalities, and none of contacts."""


class Mechanism(NamedTuple):
    """MuJoCo's trees of bodies, joints and degrees of freedom, and the sparse form of their inertia."""

    geom_type: np.ndarray
    geom_body: np.ndarray
    geom_tree: np.ndarray
    """(ngeom,) tree, -1 for what is fixed."""
    geom_weld: np.ndarray
    """(ngeom,) body to which the geom's is fixed, or itself."""
    contype: np.ndarray
    conaffinity: np.ndarray
    excluded: np.ndarray
    """Pairs of bodies that do not touch: the smaller number times 65536, plus the larger one."""
    dof_tree: np.ndarray
    dof_joint: np.ndarray
    dof_body: np.ndarray
    joint_dof: np.ndarray
    joint_type: np.ndarray
    joint_qpos: np.ndarray
    limits: np.ndarray
    limited: np.ndarray
    """(njnt,) 1 for joints with limits."""
    limit_margin: np.ndarray
    armature: np.ndarray
    """(nv,) inertias of motors (kg m² or kg)."""
    dry: np.ndarray
    """(nv,) largest efforts of motors, which are MuJoCo's dry friction (N m or N)."""
    body_parent: np.ndarray
    body_root: np.ndarray
    body_tree: np.ndarray
    """(nbody,) tree, -1 for what is fixed."""
    body_dof: np.ndarray
    body_dofs: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    centre: np.ndarray
    """(nbody, 3) centres of mass in the frames of bodies (m)."""
    tree_dof: np.ndarray
    tree_dofs: np.ndarray
    factor_count: np.ndarray
    factor_start: np.ndarray
    factor_column: np.ndarray
    slot: np.ndarray
    """(nv,) place of each motor in the order of solution, -1 for none."""
    limit_slot: np.ndarray
    """(nv,) place of each limit, which has two, -1 for none."""
    parts: np.ndarray
    """(PART, n) joint limits, motors and equalities in the order in which Bullet adds them, then -1; see
    PART_KIND."""
    equality_order: np.ndarray
    """(neq,) equalities in the order in which they were made, then -1."""
    equality_slot: np.ndarray
    """(neq,) place of each equality, which has `EQUALITY_ROWS`, -1 for none."""
    equality_tree: np.ndarray
    """(neq, 2) trees of each equality, -1 for none, -2 where MuJoCo solves it."""
    equality_aux: np.ndarray
    """(neq,) dof whose velocity a gear follows without acting on it, -1 for none, `SLIDE` for slides."""
    equality_site: np.ndarray
    """(neq, 2) sites of both frames, -1 for none."""
    site_body: np.ndarray
    equality_bound: np.ndarray
    """(neq, 2) largest forces, in the rows' units, of rows and of a weld's last three rows."""
    equality_share: np.ndarray
    """(neq,) share of the world's error reduction."""


class State(NamedTuple):
    """MuJoCo's arrays of the present step."""

    qpos: np.ndarray
    qvel: np.ndarray
    xpos: np.ndarray
    xmat: np.ndarray
    xipos: np.ndarray
    ximat: np.ndarray
    subtree_com: np.ndarray
    cvel: np.ndarray
    cdof: np.ndarray
    wrench: np.ndarray
    passive: np.ndarray
    bias: np.ndarray
    applied: np.ndarray
    actuated: np.ndarray
    factor: np.ndarray
    factor_inverse: np.ndarray
    smooth_force: np.ndarray
    smooth: np.ndarray
    qacc: np.ndarray
    constraint: np.ndarray
    site_xpos: np.ndarray
    site_xmat: np.ndarray
    link_inertia: np.ndarray
    """(nbody, 10) inertias of links about their tree's point: tensor, mass by place, mass."""


class Points(NamedTuple):
    """Points that pairs of convex shapes keep: two tables, of the step before and of this one."""

    kinds: np.ndarray
    keys: np.ndarray
    counts: np.ndarray
    points: np.ndarray
    """(2, n, 4, 17) places in the frames of both links (m), contact frame, 1 where it did not slide, gap."""
    fresh: np.ndarray
    source: np.ndarray
    extra: np.ndarray
    slots: np.ndarray
    """Place of each contact's point in the table, -1 for none."""
    turns: np.ndarray
    """(ngeom,) geoms of bodies in the order in which these were made, then -1; others have no boxes."""
    ages: np.ndarray
    """(ngeom,) place of each geom in that order, 0 for others."""
    entered: np.ndarray
    """(ngeom,) turn in which each geom's link last entered the broad phase, with the next step if it has not
    yet, 0 for others; of two shapes of a kind Bullet lists the one with the smaller number first."""
    tree_places: np.ndarray
    """(ntree,) place of each tree in the order of `links`."""
    links: np.ndarray
    """(nbody,) MuJoCo's bodies that are links in the order in which Bullet updates them, then -1."""
    firsts: np.ndarray
    """(nbody,) place in `turns` of the first geom of each link."""
    sizes: np.ndarray
    """(nbody,) number of geoms of each link."""
    tight: np.ndarray
    """(ngeom, 6) least and largest coordinates of geoms in the world (m)."""
    written: np.ndarray
    """(ngeom,) the step in which these were written."""
    bounds: np.ndarray
    """(nbody, 6) the same of links; of new ones where they were made, or the wrong way round."""
    seats: np.ndarray
    """(nbody, 9) places (m) and first two rows of the rotations of fixed links for which their boxes hold."""
    leaves: np.ndarray
    """(nbody,) nodes of links in the tree of boxes, -1 for new ones."""
    nodes: np.ndarray
    ties: np.ndarray
    tree: np.ndarray
    """The tree of boxes, which are larger than those of the links; see `box_tree`."""
    stack: np.ndarray
    """(n,) work array of `add_pairs` and of `rank_pair`."""
    pairs: np.ndarray
    """(3, n) links whose boxes meet, the smaller number first; 0 where all their shapes have ranks, -1 where
    this is to be looked at, `HIDDEN` for pairs that never touch."""
    ranked: np.ndarray
    """(3, n) pair of geoms at each rank, the smaller number first; then a number in whose order those of two
    links end."""
    table: np.ndarray
    rank_table: np.ndarray
    """Tables of the places of `pairs` and of `ranked`; see `pair_table`."""
    work: np.ndarray
    following: np.ndarray
    sequence: np.ndarray
    """Contacts in the order of solution."""
    listing: np.ndarray
    """Contacts in the order of their pairs' ranks, then all others."""
    refreshed: np.ndarray
    """(n,) links that get new boxes and pairs, one after the other."""
    notes: np.ndarray
    """(17,) number of pairs that keep points, their table, numbers of points to be added to the contacts and
    of contacts moved to anchors; numbers of pairs whose boxes meet and of those with ranks, the next to be
    checked, 1 where there was no room for one, 1 where bodies changed, 2 where the tables are to be filled,
    1 where `work` is sorted and 2 where parts of the mechanism are, too, length of the sequence, number of
    geoms of bodies, number of links in `refreshed`, length of `listing`, number of links, number of steps,
    number of ranks given so far."""


class Surface(NamedTuple):
    """Coefficients of geoms and links."""

    friction: np.ndarray
    restitution: np.ndarray
    compliance: np.ndarray
    damping: np.ndarray
    margins: np.ndarray
    reaches: np.ndarray
    boxes: np.ndarray
    """(ngeom, 4, 3) boxes of shapes; of no geom where all gaps count."""
    covers: np.ndarray
    """(nbody, 5, 3) boxes around links; see `place_box`."""
    parts: np.ndarray
    """(ngeom, 5, 3) boxes around shapes; see `place_box`."""
    compound: np.ndarray
    visits: np.ndarray
    """(ngeom, 2) order and tree of the parts of each link; see `ShapeForms`."""
    rounding: np.ndarray
    hulls: np.ndarray
    spans: np.ndarray
    anchors: np.ndarray
    base: np.ndarray
    """(nefc,) or longer: references of normals before the correction for sliding."""


class Solver(NamedTuple):
    """Motors, rules and work arrays."""

    motors: np.ndarray
    targets: np.ndarray
    largest: np.ndarray
    """(nv,) bounds of velocities."""
    rules: np.ndarray
    """(RULES,) numbers; see TIMESTEP and those that follow."""
    taken: np.ndarray
    groups: np.ndarray
    """(ntree,) work array of `order_contacts`."""
    places: np.ndarray
    parts: np.ndarray
    """(ntree + 1, 10) for each group of bodies, first and end of its rows of each kind; the last row has the
    number of groups."""
    ends: np.ndarray
    """(6,) ends of the five groups of rows, and the number of rows listed or known to do nothing, -1 where
    others solve all."""
    order: np.ndarray
    """(n, 4) of the rows in the order of solution: row, its trees (-1 for none), the contact's place in the
    list of normals (-1 for none, `HALF_TURN`)."""
    spans: np.ndarray
    """(n, 4) first degree of freedom and number of those of both trees, 0 for none."""
    jacobian: np.ndarray
    """(n, m) entries for the degrees of freedom of the first tree, then of the second."""
    scaled: np.ndarray
    """(n, m) the same of trees whose inertia is not diagonal, divided by its root; see `scale`."""
    roots: np.ndarray
    """(nv,) of `find_roots`."""
    goals: np.ndarray
    mu: np.ndarray
    soft: np.ndarray
    diagonal: np.ndarray
    """(ntree,) 1 for trees of at most `BLOCK` degrees of freedom whose inertia is diagonal in this step."""
    slots: np.ndarray
    places_of_rows: np.ndarray
    lanes: np.ndarray
    velocities: np.ndarray
    """Work arrays of `lanes`."""
    across: np.ndarray
    """Scaled entries of each degree of freedom for the rows, of which there are few."""
    table: np.ndarray
    """Effects of the rows on each other; see `solve_by_table`."""
    lines: np.ndarray
    change: np.ndarray
    wrenches: np.ndarray
    """(nbody, 6)."""
    links: np.ndarray
    neighbours: np.ndarray
    pair: np.ndarray
    """(nbody, 36), (nv, 8) and (42,) work arrays of `note_neighbours`; empty without spherical joints."""


SEARCH = record(Search, "i8[::1] i8[::1] i4[::1] i8[::1] i8 i8 i8 i8 i8")
MECHANISM = record(
    Mechanism,
    "i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1]"
    " i4[::1] f8[:,::1] u1[::1] f8[::1] f8[::1] f8[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] f8[::1]"
    " f8[:,::1] f8[:,::1]"
    " i4[::1] i4[::1] i4[::1]"
    " i4[::1] i4[::1] i4[::1] i4[::1] i4[:,::1] i4[::1] i4[::1] i4[:,::1] i4[::1] i4[:,::1] i4[::1] f8[:,::1]"
    " f8[::1]",
)
STATE = record(
    State,
    "f8[::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[::1]"
    " f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1]",
)
POINTS = record(
    Points,
    "u1[:,::1] i8[:,::1] i4[:,::1] f8[:,:,:,::1] f8[::1] i4[::1] f8[:,::1] i4[::1] i4[::1] i4[::1] i4[::1]"
    " i4[::1] i4[::1] i4[::1] i4[::1] f8[:,::1] i8[::1] f8[:,::1] f8[:,::1] i4[::1] f8[:,::1] i4[:,::1]"
    " i8[::1] i4[::1] i4[:,::1] i4[:,::1] i4[::1] i4[::1] i4[:,::1] i4[::1] i4[::1] i4[::1] i4[::1] i8[::1]",
)
SURFACE = record(
    Surface,
    "f8[:,::1] f8[::1] f8[:,::1] f8[:,::1] f8[::1] f8[::1] f8[:,:,::1] f8[:,:,::1] f8[:,:,::1] u1[::1]"
    " i4[:,::1] f8[::1] f8[:,::1] i4[:,::1] u1[::1] f8[::1]",
)
SOLVER = record(
    Solver,
    "f8[:,::1] f8[:,::1] f8[::1] f8[::1] u1[::1] i4[::1] i4[::1] i4[:,::1] i4[::1] i4[:,::1] i4[:,::1]"
    " f8[:,::1] f8[:,::1] f8[::1] f8[:,::1] f8[::1] f8[::1] u1[::1] i4[::1] i4[:,::1] f8[::1] f8[::1]"
    " f8[::1] f8[::1] f8[::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[::1]",
)
EVERYTHING = Bundle(
    (ROWS, CONTACTS, SEARCH, MECHANISM, STATE, POINTS, SURFACE, SOLVER, FIELDS, ROWS, CONTACTS, SEARCH)
)
"""Arrays of a step, the last three of them of rows that are made here."""

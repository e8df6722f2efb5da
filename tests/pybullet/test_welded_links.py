"""Contacts of links that cannot move apart, the order in which new links meet, and balls inside boxes.

The numbers are those of PyBullet 3.2.7.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

Size = tuple[float, float, float]


def link(name: str, size: Size, at: Size = (0, 0, 0), centre: Size = (0, 0, 0)) -> str:
    """A box of 1 kg."""
    box, place, mass = (" ".join(map(str, values)) for values in (size, at, centre))
    return f"""<link name="{name}"><inertial><origin xyz="{mass}"/><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><origin xyz="{place}"/><geometry><box size="{box}"/></geometry></collision></link>"""


def joint(kind: str, parent: str, child: str, at: Size) -> str:
    """A joint about y."""
    place = " ".join(map(str, at))
    return f"""<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
        <origin xyz="{place}"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="50" velocity="10"/>
        </joint>"""


def load(folder: Path, parts: list[str], *, fixed: bool, flags: int = 0) -> int:
    """Load a robot with these links and joints."""
    file = folder / "robot.urdf"
    file.write_text(f'<robot name="robot">{"".join(parts)}</robot>')
    return p.loadURDF(str(file), [0, 0, 1], useFixedBase=fixed, flags=flags)


ARM = [
    link("base", (0.2, 0.2, 0.2)),
    link("upper", (0.3, 0.1, 0.1), (0.15, 0, 0), (0.1, 0, 0.02)),
    link("cover", (0.05, 0.12, 0.05), (0, 0, 0.3)),
    link("guard", (0.1, 0.08, 0.1), (0.01, 0.005, 0)),
    link("tip", (0.1, 0.1, 0.1), (0, 0, -0.1)),
    joint("revolute", "base", "upper", (0.12, 0, 0)),
    joint("fixed", "upper", "cover", (0.1, 0, 0)),
    joint("fixed", "cover", "guard", (0.03, 0.01, 0.08)),
    joint("revolute", "upper", "tip", (0.32, 0, 0)),
]
"""The guard overlaps the upper arm, to which the cover that carries it is fixed."""


def step_arm(folder: Path, *, fixed: bool, flags: int) -> int:
    """Load the arm and let its motors turn for four steps."""
    p.setGravity(0, 0, -9.81)
    body = load(folder, ARM, fixed=fixed, flags=flags)
    for moved in (0, 3):
        p.setJointMotorControl2(body, moved, p.VELOCITY_CONTROL, targetVelocity=1 - moved, force=20)
    for _ in range(4):
        p.stepSimulation()
    return body


@pytest.mark.parametrize(
    ("fixed", "speeds", "forces", "first", "place"),
    [
        (
            False,
            (0.999894371, -1.999943286),
            (6800.84917, 5455.99729, 5958.02137, 7671.79273),
            (-0.00358, -1.14819),
            (0.210007, -0.025, 1.049283),
        ),
        (
            True,
            (0.0, -2.0),
            (44564.94194, 44564.94194, 9999.33600, 9999.33600),
            (0.0, -451.12454),
            (0.21, -0.025, 1.05),
        ),
    ],
)
def test_links_that_are_fixed_to_each_other_touch(
    client: int, tmp_path: Path, fixed: bool, speeds: Size, forces: Size, first: Size, place: Size
) -> None:
    """Their normals move nothing, but friction between them holds the joint that moves both."""
    body = step_arm(tmp_path, fixed=fixed, flags=p.URDF_USE_SELF_COLLISION)
    found = p.getContactPoints()
    assert [row[1:5] for row in found] == [(body, body, 0, 2)] * 4
    np.testing.assert_allclose([row[9] for row in found], forces, rtol=1e-7)
    np.testing.assert_allclose([row[8] for row in found], -0.02, atol=1e-6)
    np.testing.assert_allclose((found[0][10], found[0][12]), first, atol=1e-4)
    np.testing.assert_allclose(found[0][5], place, atol=1e-6)
    np.testing.assert_allclose([row[1] for row in p.getJointStates(body, [0, 3])], speeds, atol=1e-8)


def test_fixed_links_touch_only_where_self_collision_is_asked_for(client: int, tmp_path: Path) -> None:
    body = step_arm(tmp_path, fixed=True, flags=0)
    assert not p.getContactPoints()
    np.testing.assert_allclose(
        [row[1] for row in p.getJointStates(body, [0, 3])], (1.0, -1.999979924), atol=1e-8
    )


def test_links_of_a_closed_loop_touch_as_in_pybullet(client: int, tmp_path: Path) -> None:
    """Links that cannot move apart push each other, and the rounds that hold the loop go on beside them."""
    parts = [
        *(link("base", (0.2, 0.2, 0.1)), link("mount", (0.02, 0.02, 0.02)), link("block", (0.1, 0.1, 0.1))),
        *(link(name, (0.02, 0.02, 0.3), at=(0, 0, -0.15)) for name in ("left", "right")),
        *(joint("fixed", "base", "mount", (0, 0, 0.3)), joint("fixed", "mount", "block", (0, 0, -0.2005))),
        *(joint("revolute", "base", n, (x, 0.2, 0)) for n, x in (("left", 0.3), ("right", -0.3))),
    ]
    p.setGravity(0, 0, -10)
    p.setPhysicsEngineParameter(numSolverIterations=30)
    robot = load(tmp_path, parts, fixed=False, flags=p.URDF_USE_SELF_COLLISION)
    for leg in (2, 3):
        p.setJointMotorControl2(robot, leg, p.VELOCITY_CONTROL, force=0)
    frames = [0, 0, 0], [-0.3, 0, -0.25], [0.3, 0, -0.27]
    p.createConstraint(robot, 2, robot, 3, p.JOINT_POINT2POINT, *frames)
    for _ in range(4):
        p.stepSimulation()
    speeds = [p.getJointState(robot, leg)[1] for leg in (2, 3)]
    np.testing.assert_allclose(speeds, [-0.833844, -0.805071], atol=2e-6)
    linear, angular = p.getBaseVelocity(robot)
    np.testing.assert_allclose(linear, [-0.004291, 1e-6, -0.166618], atol=2e-6)
    np.testing.assert_allclose(angular, [1.1e-5, 0.047309, -0.006391], atol=2e-6)
    forces = [point[9] for point in p.getContactPoints()]
    np.testing.assert_allclose(forces, [101.6406, 156.3827, 156.3785, 101.6329], atol=1e-3)


def test_a_filter_ends_contacts_of_fixed_links(client: int, tmp_path: Path) -> None:
    body = step_arm(tmp_path, fixed=True, flags=p.URDF_USE_SELF_COLLISION)
    p.setCollisionFilterPair(body, body, 0, 2, 0)
    p.stepSimulation()
    assert not p.getContactPoints()
    p.performCollisionDetection()
    assert not p.getContactPoints()
    p.setCollisionFilterPair(body, body, 0, 2, 1)
    p.performCollisionDetection()
    assert {row[3:5] for row in p.getContactPoints()} == {(0, 2)}


def test_new_links_meet_where_their_centres_of_mass_are_taken_for_their_frames(
    client: int, tmp_path: Path
) -> None:
    """Until the first step, Bullet has the second link 0.3 m away from the first one."""
    parts = [link("base", (0.1, 0.1, 0.1))]
    for k, x in enumerate((0.0, 0.09, 0.4, 0.49)):
        parts += [
            link(f"link{k}", (0.1, 0.1, 0.1), centre=(0, 0.3 if k == 1 else 0, 0)),
            joint("revolute", "base", f"link{k}", (x, 0.5, 0)),
        ]
    load(tmp_path, parts, fixed=True, flags=p.URDF_USE_SELF_COLLISION)
    p.stepSimulation()
    pairs = dict.fromkeys(tuple(sorted(row[3:5])) for row in p.getContactPoints())
    assert list(pairs) == [(2, 3), (0, 1)]


def test_a_ball_whose_centre_is_inside_a_box_leaves_by_the_nearest_face(client: int) -> None:
    """A small ball falls so far within one step; the way out is its radius and the depth of its centre."""
    ground = p.createMultiBody(
        0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[100, 100, 5]), basePosition=[0, 0, -5]
    )
    ball = p.createMultiBody(0.1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.005))
    for depth in (0.0, 0.00175, 0.004, 0.03):
        p.resetBasePositionAndOrientation(ball, [0.3, 0.2, -depth], [0, 0, 0, 1])
        p.performCollisionDetection()
        found = p.getContactPoints(ball, ground)
        deepest = min(found, key=lambda row: row[8])
        np.testing.assert_allclose(deepest[8], -0.005 - depth, atol=1e-9)
        np.testing.assert_allclose(np.abs(deepest[7]), (0, 0, 1), atol=1e-9)
        np.testing.assert_allclose(deepest[6], (0.3, 0.2, 0), atol=1e-9)
    p.resetBasePositionAndOrientation(ball, [0, 0, 0.016181], [0, 0, 0, 1])
    p.resetBaseVelocity(ball, [0, 0, -4.26545])
    for _ in range(2):
        p.stepSimulation()
    assert p.getBaseVelocity(ball)[0][2] > 0.0

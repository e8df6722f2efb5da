"""Links without mass, and the numbers of links, compared with PyBullet 3.2.7."""

from __future__ import annotations

from typing import Any

import pytest

import roboyard.pybullet as p


def _arm(masses: list[float], base: float, parents: list[int] | None = None, flags: int = 0) -> int:
    """Capsules on a shoulder of two joints at one place, then two more joints."""
    count, shape = len(masses), p.createCollisionShape(p.GEOM_CAPSULE, radius=0.05, height=0.2)
    places, axes = [[0.2, 0, 0], [0, 0, 0], [0, 0, -0.1], [0, 0, -0.3]], [[0, 1, 0], [1, 0, 0]] * 2
    axes[2:] = [[0, 1, 0], [0, 0, 1]]
    turn = [[0, 0, 0, 1]] * count
    return p.createMultiBody(
        base, shape, -1, [0, 0, 1],
        linkMasses=masses,
        linkCollisionShapeIndices=[-1, -1, shape, shape][:count] + [-1] * (count - 4),
        linkVisualShapeIndices=[-1] * count,
        linkPositions=(places * 2)[:count],
        linkOrientations=turn,
        linkInertialFramePositions=[[0, 0, 0]] * count,
        linkInertialFrameOrientations=turn,
        linkParentIndices=parents or list(range(count)),
        linkJointTypes=[p.JOINT_REVOLUTE] * count,
        linkJointAxis=(axes * 2)[:count],
        flags=flags,
    )  # fmt: skip


def _hit(arm: int, zeroed: tuple[int, ...], *, driven: bool) -> tuple[list[float], Any]:
    """Throw a ball at the arm; return its joints' positions and the ball's place after a quarter second."""
    p.setGravity(0, 0, -9.8)
    for joint in range(4):
        p.resetJointState(arm, joint, 0.1)
    for joint in zeroed:
        p.changeDynamics(arm, joint, mass=0)
    for joint in range(4):
        if driven:
            p.setJointMotorControl2(arm, joint, p.POSITION_CONTROL, 0.4, force=30)
        else:
            p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, force=0)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0.8, 0, 0.6])
    p.resetBaseVelocity(ball, [-4, 0, 1.5])
    for _ in range(60):
        p.stepSimulation()
    return [p.getJointState(arm, joint)[0] for joint in range(4)], p.getBasePositionAndOrientation(ball)[0]


@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize(
    ("masses", "zeroed"),
    [([0, 0, 2, 1], (2, 3)), ([0, 0, 2, 0], (2,)), ([0, 0, 0, 0], ()), ([0, 0, 0, 0], (3,))],
)
def test_nothing_moves_joints_beyond_which_nothing_has_mass(
    client: int, masses: list[float], zeroed: tuple[int, ...], driven: bool
) -> None:
    joints, ball = _hit(_arm(masses, 0), zeroed, driven=driven)
    assert joints == pytest.approx([0.1] * 4, abs=1e-4)
    assert ball == pytest.approx((0.291, -0.072, 0.657), abs=2e-3), "it bounces as off a wall"


@pytest.mark.parametrize(
    ("masses", "base", "zeroed", "joints", "ball"),
    [
        ([0, 0, 2, 1], 0, (), (0.5624, 0.0718, -0.0581, -0.2122), (0.172, -0.043, 0.656)),
        ([0, 0, 2, 1], 0, (3,), (0.5407, 0.0363, 1.3451, 0.1), (-0.019, -0.012, 0.637)),
        ([0, 0, 2, 0], 1, (), (2.0385, 0.1998, -0.8686, 0.1), (0.143, -0.031, 0.527)),
        ([0, 0, 2, 0], 1, (2,), (0.1, 0.1, 0.1, 0.1), (-0.052, -0.005, 0.601)),
    ],
)
def test_the_other_joints_move(
    client: int, masses: list[float], base: float, zeroed: tuple[int, ...], joints: Any, ball: Any
) -> None:
    found, place = _hit(_arm(masses, base), zeroed, driven=False)
    assert found == pytest.approx(joints, abs=0.02)
    assert place == pytest.approx(ball, abs=0.02)


def test_a_joint_is_free_again_with_mass(client: int) -> None:
    arm = _arm([0, 0, 2, 0], 0)
    p.changeDynamics(arm, 2, mass=0)
    p.changeDynamics(arm, 2, mass=2)
    joints, _ = _hit(arm, (), driven=False)
    assert joints == pytest.approx((0.5407, 0.0363, 1.3451, 0.1), abs=0.02)


@pytest.mark.parametrize(
    ("parents", "flags", "names"),
    [
        ([0, 1, 0, 1, 2], 0, "12543"),
        ([0, 1, 0, 1, 2], p.URDF_MAINTAIN_LINK_ORDER, "12345"),
        ([0, 0, 1, 2, 3, 1], 0, "135624"),
        ([0, 3, 1], 0, "132"),
    ],
)
def test_links_are_numbered_depth_first(client: int, parents: list[int], flags: int, names: str) -> None:
    body = _arm([1.0 + link for link in range(len(parents))], 1, parents, flags)
    infos = [p.getJointInfo(body, joint) for joint in range(p.getNumJoints(body))]
    assert [info[12].decode() for info in infos] == [f"link{name}" for name in names]
    assert [p.getDynamicsInfo(body, joint)[0] for joint in range(len(names))] == [float(n) for n in names]
    by_name = {int(name): place for place, name in enumerate(names)}
    assert [info[16] for info in infos] == [by_name.get(parents[int(name) - 1], -1) for name in names]


def test_a_link_that_hangs_on_nothing_is_refused(client: int) -> None:
    with pytest.raises(p.error, match="createMultiBody failed") as caught:
        _arm([1, 1, 1], 1, [0, 3, 2])
    assert "does not lead to the base" in str(caught.value.__notes__)

"""Mass properties for engines, against closed forms and an independent eigenvalue solver."""

import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

from roboyard.description.mass_properties import (
    MASSLESS_FRACTION,
    link_masses,
    mass_properties,
    massless_parts,
    part_masses,
    possible_moments,
    trace_mass,
)
from roboyard.description.model import Inertial, Joint, Link, Pose, RobotDescription


def inertial(tensor, mass: float = 2.0, **pose) -> Inertial:
    tensor = np.asarray(tensor, dtype=float)
    values = tuple(tensor[np.triu_indices(3)].tolist())
    return Inertial(mass=mass, origin=Pose(**pose), inertia=values)


def tensor_of(properties) -> np.ndarray:
    """The tensor in the link frame that the principal moments and axes give."""
    turn = Rotation.from_quat(properties.quaternion).as_matrix()
    return turn @ np.diag(properties.principal) @ turn.T


def test_a_diagonal_tensor_keeps_the_axes_and_the_order_of_the_file() -> None:
    turn = (0.5, 0.5, 0.5, 0.5)
    found = mass_properties(inertial(np.diag([3, 1, 2.5]), position=(1, 2, 3), quaternion=turn))
    np.testing.assert_array_equal(found.principal, (3, 1, 2.5))
    np.testing.assert_array_equal(found.quaternion, turn)
    np.testing.assert_array_equal(found.position, (1, 2, 3))
    assert (found.mass, found.note) == (2, None)


@pytest.mark.parametrize("seed", range(6))
def test_principal_axes_and_moments_give_the_tensor_back(seed: int) -> None:
    """The tensor of a random cloud of point masses, in an inertial frame that is itself turned."""
    rng = np.random.default_rng(seed)
    points, masses = rng.normal(size=(12, 3)), rng.uniform(0.1, 1, 12)
    points -= np.average(points, axis=0, weights=masses)
    tensor = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    frame = Rotation.random(random_state=rng)
    found = mass_properties(inertial(tensor, masses.sum(), quaternion=tuple(frame.as_quat().tolist())))
    expected = frame.as_matrix() @ tensor @ frame.as_matrix().T
    np.testing.assert_allclose(tensor_of(found), expected, atol=1e-12)
    np.testing.assert_allclose(np.sort(found.principal), scipy.linalg.eigvalsh(tensor), rtol=1e-12)
    assert found.note is None


@pytest.mark.parametrize("scale", [0.1, 2.0, 10.0])
def test_scaling_a_solid_box_gives_the_box_of_that_size(scale: float) -> None:
    size = np.array([0.2, 0.3, 0.4])

    def box(extents: np.ndarray) -> Inertial:
        mass = 1000 * np.prod(extents)
        return inertial(np.diag(mass / 12 * ((extents**2).sum() - extents**2)), float(mass))

    small, large = mass_properties(box(size), scale), mass_properties(box(size * scale))
    assert small.mass == pytest.approx(large.mass)
    np.testing.assert_allclose(small.principal, large.principal, rtol=1e-12)
    assert mass_properties(inertial(np.eye(3), position=(1, 0, -2)), scale).position == pytest.approx(
        (scale, 0, -2 * scale)
    )


@pytest.mark.parametrize(
    ("given", "expected", "problem"),
    [
        ((1, 1, 2), (1, 1, 2), None),
        ((1, 1, 3), (1.5, 1.5, 3), "break the triangle inequality"),
        ((5, 1, 2), (5, 2, 3), "break the triangle inequality"),
        ((0, 1, 1), (1e-6, 1, 1), "are not all positive"),
        ((-1, 2, 2), (2e-6, 2, 2), "are not all positive"),
        ((1e-8, 1, 1), (1e-6, 1, 1), None),
        ((0, 0, 1), (0.5, 0.5, 1), "are not all positive"),
        ((0, 0, 0), (1e-12, 1e-12, 1e-12), "are not all positive"),
    ],
)
def test_impossible_moments_are_raised_as_little_as_possible(given, expected, problem: str | None) -> None:
    found, note = possible_moments(np.array(given, dtype=float))
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert (note is None) == (problem is None)
    if problem is not None:
        assert problem in str(note)
    small, middle, large = np.sort(found)
    assert small > 0
    assert small + middle >= large


def test_corrected_moments_of_random_triples_are_possible_and_stay_so() -> None:
    rng = np.random.default_rng(3)
    for triple in rng.normal(size=(200, 3)) * 10.0 ** rng.uniform(-8, 4, (200, 1)):
        once, _ = possible_moments(triple)
        small, middle, large = np.sort(once)
        assert small > 0
        assert small + middle >= large
        np.testing.assert_allclose(possible_moments(once)[0], once, rtol=1e-14)
        assert (once >= triple - 1e-15 * abs(triple)).all()


def test_negative_and_zero_masses_have_no_moments() -> None:
    negative = mass_properties(inertial(np.eye(3), -2.0))
    assert (negative.mass, negative.note) == (0, "mass -2 kg is negative, taken as 0")
    np.testing.assert_array_equal(negative.principal, 0)
    assert mass_properties(inertial(np.eye(3), 0.0)).note is None


def robot_of(*rows: tuple[str, str, str, float]) -> RobotDescription:
    """(parent, child, joint type, mass of the child) a row; the base has 1 kg."""
    masses = {"base": 1.0, **{child: mass for _, child, _, mass in rows}}
    links = tuple(
        Link(name=name, inertial=inertial(np.eye(3), mass) if mass else None) for name, mass in masses.items()
    )
    joints = tuple(
        Joint(name=child, type=kind, parent=parent, child=child, origin=Pose(position=(0, 0.3, 0.4)))  # type: ignore[arg-type]
        for parent, child, kind, _ in rows
    )
    return RobotDescription(name="r", links=links, joints=joints)


TREE = robot_of(
    ("base", "plate", "fixed", 2.0),
    ("plate", "arm", "revolute", 0.0),
    ("arm", "shell", "fixed", 3.0),
    ("shell", "wrist", "continuous", 0.0),
    ("wrist", "frame", "fixed", 0.0),
    ("frame", "tool", "prismatic", 4.0),
)


def test_parts_are_links_fixed_together_and_their_masses_add_up() -> None:
    masses = link_masses(TREE)
    assert part_masses(TREE, masses) == {"base": 3, "arm": 3, "wrist": 0, "tool": 4}
    assert [name for name, found in masses.items() if found is None] == ["arm", "wrist", "frame"]


def test_massless_parts_are_named_by_their_first_link() -> None:
    masses = link_masses(TREE)
    assert massless_parts(TREE, masses, fixed_base=True) == ("wrist",)
    empty = robot_of(("base", "arm", "revolute", 0.0))
    bare = dict.fromkeys(("base", "arm"))
    assert massless_parts(empty, bare, fixed_base=True) == ("arm",)
    assert massless_parts(empty, bare, fixed_base=False) == ("base", "arm")


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_a_trace_of_mass_is_a_millionth_of_the_robot_at_its_reach(scale: float) -> None:
    """Six joints of 0.5 m each: 3 m of reach; 10 kg in all."""
    found = trace_mass(TREE, link_masses(TREE, scale), scale)
    assert found.mass == pytest.approx(10 * scale**3 * MASSLESS_FRACTION)
    np.testing.assert_allclose(found.principal, found.mass * (3 * scale) ** 2, rtol=1e-12)


def test_keep_massless_returns_the_notes_of_links_without_mass() -> None:
    robot = RobotDescription(name="r", links=(Link(name="a", inertial=inertial(np.eye(3), -1.0)),))
    assert link_masses(robot) == {"a": None}
    kept = link_masses(robot, keep_massless=True)["a"]
    assert kept is not None
    assert "negative" in str(kept.note)

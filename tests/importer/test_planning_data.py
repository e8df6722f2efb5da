"""Self-collision pairs against postures sampled with MuJoCo itself, sphere coverage, and joint sampling."""

from __future__ import annotations

import math
from itertools import combinations
from pathlib import Path

import mujoco
import numpy as np
import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Joint, Limit
from roboyard.description.robot_model import CollisionSphere, RobotModel
from roboyard.description.semantic import SemanticDescription
from roboyard.description.urdf.parse import parse_urdf
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import ImportLog
from roboyard.importer.planning.link_spheres import fit_links
from roboyard.importer.planning.self_collision import (
    NEVER_MARGIN,
    PostureSampler,
    adjacent_pairs,
    contacts_at,
    sample_range,
    self_collision_matrix,
)
from roboyard.importer.planning.sphere_pairs import SphereSets
from roboyard.importer.steps.planning import add_planning_data
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.shapes.spheres.fit import fit_spheres
from roboyard.sim import World

LIMITS = '<limit lower="{}" upper="{}" effort="5" velocity="1"/>'
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def planar_arm() -> RobotDescription:
    """Four links of 0.2 m in a plane with hinges of +-2.6 rad, and a post beside the base.

    Each link carries spheres of 4 cm along itself; the post is out of reach of the first two links only.
    """
    parts, joints = ["base", "post", "l1", "l2", "l3", "l4"], []
    for k in range(1, 5):
        joints.append(
            f'<joint name="j{k}" type="revolute"><parent link="{"base" if k == 1 else f"l{k - 1}"}"/>'
            f'<child link="l{k}"/><origin xyz="{0 if k == 1 else 0.2} 0 0"/><axis xyz="0 0 1"/>'
            f"{LIMITS.format(-2.6, 2.6)}</joint>"
        )
    joints.append(
        '<joint name="stand" type="fixed"><parent link="base"/><child link="post"/>'
        '<origin xyz="0 -0.6 0"/></joint>'
    )
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in parts)
    return load_description(f'<robot name="r">{links}{"".join(joints)}</robot>')


def rod(length: float = 0.2) -> tuple[CollisionSphere, ...]:
    return tuple(
        CollisionSphere(center=(x, 0.0, 0.0), radius=0.04) for x in np.linspace(0.05, length - 0.05, 3)
    )


SPHERES = {
    "base": (CollisionSphere(center=(0.0, 0.0, 0.0), radius=0.03),),
    "post": (CollisionSphere(center=(0.0, 0.0, 0.0), radius=0.06),),
    **{f"l{k}": rod() for k in range(1, 5)},
}
MJCF = """<mujoco><compiler angle="radian"/><worldbody><body name="base">
<geom name="base_0" size="0.03" pos="0 0 0"/>
<body name="post" pos="0 -0.6 0"><geom name="post_0" size="0.06"/></body>
{arm}</body></worldbody></mujoco>"""


def mujoco_arm() -> mujoco.MjModel:
    """The same arm, written by hand."""
    arm = ""
    for k in range(4, 0, -1):
        spheres = "".join(
            f'<geom name="l{k}_{n}" size="0.04" pos="{x} 0 0"/>' for n, x in enumerate((0.05, 0.1, 0.15))
        )
        x = 0 if k == 1 else 0.2
        hinge = f'<joint name="j{k}" range="-2.6 2.6" axis="0 0 1"/>'
        arm = f'<body name="l{k}" pos="{x} 0 0">{hinge}{spheres}{arm}</body>'
    return mujoco.MjModel.from_xml_string(MJCF.format(arm=arm))


def sampled_gaps(count: int, seed: int) -> dict[tuple[str, str], np.ndarray]:
    """Smallest distance of each pair of links in each of `count` postures, by MuJoCo's own function."""
    model = mujoco_arm()
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    geoms = {
        name: [g for g in range(model.ngeom) if model.geom(g).name.startswith(f"{name}_")] for name in SPHERES
    }
    pairs = list(combinations(["base", "post", "l1", "l2", "l3", "l4"], 2))
    out = {pair: np.empty(count) for pair in pairs}
    for k in range(count):
        data.qpos[:] = rng.uniform(-2.6, 2.6, 4)
        mujoco.mj_kinematics(model, data)
        for a, b in pairs:
            out[a, b][k] = min(
                mujoco.mj_geomDistance(model, data, g, h, 10.0, None) for g in geoms[a] for h in geoms[b]
            )
    return out


@pytest.fixture(scope="module")
def matrix():
    return self_collision_matrix(
        planar_arm(), SPHERES, dict.fromkeys(["j1", "j2", "j3", "j4"], 0.0), samples=1500
    )


def test_pairs_that_mujoco_sees_collide_are_never_dropped_as_colliding_never(matrix) -> None:
    gaps = sampled_gaps(400, seed=11)
    for pair in matrix.never:
        assert gaps[pair].min() > 0, pair
    for pair, found in gaps.items():
        # one in twenty independent postures within the margin cannot escape 1500 others
        if (found < NEVER_MARGIN).mean() > 0.05:
            assert pair not in matrix.never, pair
        if (found < 0).mean() < 0.9:
            assert pair not in matrix.always, pair


def test_every_pair_of_links_is_in_at_most_one_list_and_in_link_order(matrix) -> None:
    listed = [*matrix.adjacent, *matrix.at_rest, *matrix.always, *matrix.never]
    assert len(set(listed)) == len(listed)
    order = [link.name for link in planar_arm().links]
    assert all(order.index(a) < order.index(b) for a, b in listed)
    ignored = {(a, b) for a, others in matrix.ignore().items() for b in others}
    assert ignored == set(listed)
    # the tip can reach the post and its own first link: a planner has to check both
    assert not {("post", "l4"), ("l1", "l4")} & ignored
    assert {("post", "l1"), ("base", "post"), ("base", "l1"), ("l1", "l2")} <= ignored


def test_gaps_of_a_posture_equal_mujocos_distances() -> None:
    names = list(SPHERES)
    sets = SphereSets.of(names, SPHERES)
    q = np.array([0.3, -1.1, 0.9, 1.7])
    frames = forward_kinematics(planar_arm(), {f"j{k + 1}": value for k, value in enumerate(q)})
    found = sets.gaps(
        np.array([frames[name][:3, 3] for name in names]), np.array([frames[name][:3, :3] for name in names])
    )
    model = mujoco_arm()
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    for (i, a), (j, b) in combinations(enumerate(names), 2):
        geoms = [[g for g in range(model.ngeom) if model.geom(g).name.startswith(f"{x}_")] for x in (a, b)]
        least = min(mujoco.mj_geomDistance(model, data, g, h, 10.0, None) for g in geoms[0] for h in geoms[1])
        assert found[i, j] == pytest.approx(least, abs=1e-9), (a, b)
    assert np.isinf(found[np.tril_indices(len(names))]).all()


def test_frames_of_sampled_postures_equal_mujocos() -> None:
    sampler = PostureSampler(planar_arm())
    postures = sampler.random(20, np.random.default_rng(4))
    assert np.abs(postures).max() <= 2.6
    positions, rotations = sampler.frames(postures, ["l4", "post"])
    model = mujoco_arm()
    data = mujoco.MjData(model)
    for k, posture in enumerate(postures):
        data.qpos[:] = [posture[sampler.address[f"j{n}"]] for n in range(1, 5)]
        mujoco.mj_kinematics(model, data)
        assert positions[k, 0] == pytest.approx(data.body("l4").xpos, abs=1e-12)
        assert rotations[k, 0] == pytest.approx(data.body("l4").xmat.reshape(3, 3), abs=1e-12)
        assert positions[k, 1] == pytest.approx([0, -0.6, 0])


def limited(kind: str, lower: float | None, upper: float | None, name: str = "j") -> Joint:
    limit = None if lower is None or upper is None else Limit(lower=lower, upper=upper, effort=1, velocity=1)
    return Joint(name=name, type=kind, parent="a", child="b", limit=limit)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("joint", "expected"),
    [
        (limited("revolute", -1, 2), (-1, 2)),
        (limited("revolute", -9, 9), (-math.pi, math.pi)),
        (limited("continuous", None, None), (-math.pi, math.pi)),
        (limited("revolute", 4, 5), (4, 5)),
        (limited("revolute", -5, -4), (-5, -4)),
        (limited("revolute", -20, -2), (-math.pi, -2)),
        (limited("prismatic", None, None), (-0.5, 0.5)),
        (limited("prismatic", -1, 99), (-1, 10)),
        (limited("prismatic", 11, 12), (11, 12)),
        (limited("prismatic", 0, 1, "base_footprint_x_joint"), (0, 0)),
    ],
)
def test_joints_are_sampled_inside_their_limits(joint: Joint, expected: tuple[float, float]) -> None:
    lower, upper = sample_range(joint)
    assert (lower, upper) == pytest.approx(expected)
    limits = joint.position_limits()
    if limits is not None and not joint.name.startswith("base_footprint_"):
        assert limits[0] <= lower <= upper <= limits[1]


def test_a_joint_with_limits_beyond_half_a_turn_has_a_matrix() -> None:
    """The arm swings between -5 and -4 rad and meets only a post there."""
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in ("base", "arm", "post"))
    hinge = '<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>'
    post = '<joint name="k" type="prismatic"><parent link="base"/><child link="post"/><axis xyz="0 0 1"/>'
    text = f"{hinge}{LIMITS.format(-5, -4)}</joint>{post}{LIMITS.format(0, 0.01)}</joint>"
    description = load_description(f'<robot name="r">{links}{text}</robot>')
    spheres = {
        "arm": (CollisionSphere(center=(1.0, 0.0, 0.0), radius=0.1),),
        "post": (CollisionSphere(center=(math.cos(-4.5), math.sin(-4.5), 0.0), radius=0.1),),
    }
    rest = {"j": -4.0, "k": 0.0}
    found = self_collision_matrix(description, spheres, rest, samples=300)
    assert found.never == found.always == ()  # they meet in part of the range, at -4.5 rad
    away = {**spheres, "post": (CollisionSphere(center=(1.0, 0.0, 0.0), radius=0.1),)}
    assert self_collision_matrix(description, away, rest, samples=300).never == (("arm", "post"),)


def test_followers_follow_in_random_postures_and_at_rest() -> None:
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in "abcd")
    one = '<joint name="{n}" type="revolute"><parent link="a"/><child link="{c}"/><axis xyz="0 0 1"/>{m}'
    joints = [
        one.format(n="j1", c="b", m='<mimic joint="j2" multiplier="-2" offset="0.25"/>'),
        one.format(n="j2", c="c", m='<mimic joint="j3" multiplier="0.5"/>'),
        one.format(n="j3", c="d", m=""),
    ]
    text = "".join(f"{part}{LIMITS.format(-3, 3)}</joint>" for part in joints)
    sampler = PostureSampler(load_description(f'<robot name="r">{links}{text}</robot>'))
    q = sampler.random(50, np.random.default_rng(0))
    first, second, third = (q[:, sampler.address[f"j{k}"]] for k in (1, 2, 3))
    assert second == pytest.approx(0.5 * third)
    assert first == pytest.approx(-2 * second + 0.25)
    assert np.ptp(third) > 4
    rest = sampler.posture({"j3": 1.0, "j1": 9.0})
    assert [rest[sampler.address[f"j{k}"]] for k in (1, 2, 3)] == pytest.approx([-0.75, 0.5, 1.0])


def test_links_without_spheres_and_without_motion_join_their_neighbours() -> None:
    """a -moves- b -fixed- c -moves- d: without b, its neighbours are adjacent to each other."""
    links = "".join(f'<link name="{name}"/>' for name in "abcde")
    kinds = (("a", "b", "continuous"), ("b", "c", "fixed"), ("c", "d", "continuous"), ("b", "e", "fixed"))
    joints = "".join(
        f'<joint name="j{p}{c}" type="{kind}"><parent link="{p}"/><child link="{c}"/></joint>'
        for p, c, kind in kinds
    )
    robot = load_description(f'<robot name="r">{links}{joints}</robot>')
    every = {("a", "b"), ("b", "c"), ("b", "e"), ("c", "d"), ("c", "e")}
    assert adjacent_pairs(robot, list("abcde")) == every
    assert adjacent_pairs(robot, list("acde")) == {("a", "c"), ("a", "e"), ("c", "d"), ("c", "e")}
    assert adjacent_pairs(robot, ["a", "d"]) == {("a", "d")}


BOX = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'


def stack(gap: float) -> RobotDescription:
    """Boxes of 0.2 m on two slides of one base; the second is `gap` above the first."""
    parts = "".join(
        f'<link name="{n}">{INERTIAL}{BOX if n != "base" else ""}</link>' for n in ("base", "low", "high")
    )
    for name, z in (("low", 0.0), ("high", 0.2 + gap)):
        parts += (
            f'<joint name="{name}_joint" type="prismatic"><parent link="base"/><child link="{name}"/>'
            f'<origin xyz="0 0 {z}"/><axis xyz="0 0 1"/>{LIMITS.format(-0.1, 0.1)}</joint>'
        )
    return load_description(f'<robot name="r">{parts}</robot>')


@pytest.mark.parametrize(("gap", "low", "depth"), [(-0.03, 0.0, 0.03), (0.01, 0.0, None), (0.01, 0.05, 0.04)])
def test_overlaps_of_boxes_are_found_with_their_depth(gap: float, low: float, depth: float | None) -> None:
    world = World(visual_geoms=False)
    body = world.add_description(stack(gap), fixed_base=True, self_collision=True, drives=False)
    found = contacts_at(body, world, {"low_joint": low, "high_joint": 0.0})
    if depth is None:
        assert found == []
    else:
        ((a, b, deep),) = found
        assert (a, b) == ("low", "high")
        assert deep == pytest.approx(depth, abs=1e-6)


def context(folder: Path, robot: str, **config) -> ImportContext:
    file = folder / "r.urdf"
    file.write_text(robot)
    return ImportContext(
        config=ImportConfig.model_validate({"urdf_path": "r.urdf", "name": "r", **config}),
        urdf=file,
        source=parse_urdf(file),
        build=folder,
        log=ImportLog(),
    )


def planned(folder: Path, **curobo):
    description = stack(-0.03)
    robot = RobotModel(
        name="r",
        description=description,
        semantic=SemanticDescription(base_link="base"),
        solids={link.name: link.collisions for link in description.links},
    )
    here = context(folder, '<robot name="r"><link name="a"/></robot>', curobo=curobo)
    return add_planning_data(robot, here), here.log


def test_planning_data_disable_pairs_that_overlap_at_rest(tmp_path: Path) -> None:
    made, log = planned(tmp_path)
    assert made.semantic.disabled_collision_pairs == (("low", "high"),)
    assert made.semantic.rest == {"low_joint": 0.0, "high_joint": 0.0}
    assert log.facts["overlaps_at_rest"] == [
        {"links": ["low", "high"], "depth_mm": pytest.approx(30, abs=0.01)}
    ]
    assert made.planning is not None
    assert "high" in made.planning.ignore["low"]
    assert log.facts["self_collision"]["at_rest"] == [["low", "high"]]


def test_a_configured_matrix_is_used_as_given_with_a_warning_of_what_it_misses(tmp_path: Path) -> None:
    made, log = planned(tmp_path, self_collision_ignore={"base": ["low"]})
    assert made.planning is not None
    assert made.planning.ignore == {"base": ("low",)}
    (warning,) = log.warnings
    assert 'overlaps "high" by 30.0 mm at rest' in warning.message
    assert planned(tmp_path, self_collision_ignore={"high": ["low"]})[1].warnings == ()


def test_configured_spheres_are_used_as_given(tmp_path: Path) -> None:
    spheres = {"low": [{"center": [0, 0, 0.1], "radius": 0.25}]}
    made, log = planned(tmp_path, collision_spheres=spheres, lock_joints={"low_joint": None})
    assert made.planning is not None
    assert made.planning.spheres == {"low": (CollisionSphere(center=(0.0, 0.0, 0.1), radius=0.25),)}
    assert made.planning.lock_joints == {"low_joint": 0.0}
    assert any("1 collision spheres on 1 links, as given" in d.message for d in log.decisions)


def shapes(text: str):
    return load_description(f'<robot name="r"><link name="a">{text}</link></robot>').links[0].collisions


def inside(points: np.ndarray, spheres: tuple[CollisionSphere, ...]) -> np.ndarray:
    centers, radii = np.array([s.center for s in spheres]), np.array([s.radius for s in spheres])
    return (np.linalg.norm(points[:, None] - centers, axis=2) <= radii).any(axis=1)


def test_fitted_spheres_cover_as_much_of_a_box_as_they_report(tmp_path: Path) -> None:
    """Points drawn inside the box, counted by their distances to the centres."""
    box = shapes('<collision><origin xyz="3 0 0"/><geometry><box size="0.3 0.2 0.1"/></geometry></collision>')
    here = context(tmp_path, '<robot name="r"><link name="a"/></robot>')
    found = fit_links({"a": box, "none": ()}, here, preset="balanced")
    assert list(found) == ["a"]
    points = np.random.default_rng(1).uniform((2.85, -0.1, -0.05), (3.15, 0.1, 0.05), (20000, 3))
    fact = here.log.facts["spheres"]["a"]
    assert inside(points, found["a"]).mean() == pytest.approx(fact["coverage"], abs=0.02)
    assert fact["coverage"] > 0.9
    assert fact["spheres"] == len(found["a"])


def test_equal_shapes_elsewhere_get_the_same_spheres_moved(tmp_path: Path) -> None:
    text = '<collision><origin xyz="{} 0 0"/><geometry><box size="0.3 0.2 0.1"/></geometry></collision>'
    here = context(tmp_path, '<robot name="r"><link name="a"/></robot>')
    found = fit_links({"a": shapes(text.format(0)), "b": shapes(text.format(1.5))}, here, preset="balanced")
    first, second = (np.array([(*s.center, s.radius) for s in found[name]]) for name in "ab")
    assert second == pytest.approx(first + np.array([1.5, 0, 0, 0]), abs=2e-5)
    assert here.log.facts["spheres"]["b"]["cached"] is True


def test_links_fitted_side_by_side_have_the_spheres_of_a_fit_alone(tmp_path: Path) -> None:
    text = '<collision><geometry><box size="{} 0.2 0.1"/></geometry></collision>'
    boxes = {f"l{k}": shapes(text.format(0.2 + 0.05 * k)) for k in range(5)}
    here = context(tmp_path, '<robot name="r"><link name="a"/></robot>')
    found = fit_links(boxes, here, preset="balanced")
    assert list(found) == list(here.log.facts["spheres"]) == list(boxes)
    for name, box in boxes.items():
        alone = fit_spheres(shape_meshes(box), preset="balanced")
        assert np.array([s.center for s in found[name]]) == pytest.approx(alone.centers, abs=1e-5)
        assert np.array([s.radius for s in found[name]]) == pytest.approx(alone.radii, abs=2e-5)


def test_shapes_that_are_spheres_are_kept_exactly(tmp_path: Path) -> None:
    sphere = '<collision><origin xyz="{} 0 0"/><geometry><sphere radius="{}"/></geometry></collision>'
    here = context(tmp_path, '<robot name="r"><link name="a"/></robot>')
    found = fit_links({"a": shapes(sphere.format(1, 0.1) + sphere.format(2, 0.2))}, here, preset="balanced")
    assert found["a"] == (
        CollisionSphere(center=(1.0, 0.0, 0.0), radius=0.1),
        CollisionSphere(center=(2.0, 0.0, 0.0), radius=0.2),
    )
    assert here.log.facts["spheres"]["a"] == {"spheres": 2, "exact": True}


def test_a_point_that_collides_within_a_larger_body_keeps_its_sphere(tmp_path: Path) -> None:
    """A collision sphere of 1 mm in a box that is seen: the box is covered, and the sphere is, too."""
    text = (
        '<robot name="r"><link name="head"><visual><origin xyz="0 0 0.3"/><geometry>'
        '<box size="0.2 0.2 0.2"/></geometry></visual><collision><geometry>'
        '<sphere radius="0.001"/></geometry></collision></link></robot>'
    )
    description = load_description(text)
    robot = RobotModel(
        name="r",
        description=description,
        semantic=SemanticDescription(base_link="head"),
        solids={link.name: link.collisions for link in description.links},
    )
    made = add_planning_data(robot, context(tmp_path, text))
    assert made.planning is not None
    spheres = made.planning.spheres["head"]
    assert inside(np.array([[0.0, 0.0, 0.0005]]), spheres).all()
    assert inside(np.array([[0.0, 0.0, 0.3], [0.08, 0.08, 0.38]]), spheres).all()

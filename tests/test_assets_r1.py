"""R1: names, a vendor's faults, geometry that fits the configured spheres, poses that make sense."""

from __future__ import annotations

import functools
import itertools
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import trimesh
import yaml
from scipy.spatial import ConvexHull

from roboyard.assets import asset_path

SIDES = ("left", "right")
UNTUCKED = (0.0, 1.906, -0.991, 1.571, 0.915, -1.571)


def untucked() -> dict[str, float]:
    return {f"{side}_arm_joint{i}": v for side in SIDES for i, v in enumerate(UNTUCKED, start=1)}


POSES = {
    "tucked": {},
    "untucked": untucked(),
    "crouching": untucked() | {"torso_joint1": 0.8, "torso_joint2": -1.6, "torso_joint3": 0.8},
}


@functools.cache
def robot() -> ET.Element:
    return ET.parse(asset_path("r1")).getroot()


@functools.cache
def config() -> dict:
    return yaml.safe_load(asset_path("r1").with_name("r1_source_config.yaml").read_text())


def numbers(text: str | None, default: str = "0 0 0") -> np.ndarray:
    return np.array([float(x) for x in (text or default).split()])


def pose(origin: ET.Element) -> np.ndarray:
    (cr, cp, cy), (sr, sp, sy) = np.cos(numbers(origin.get("rpy"))), np.sin(numbers(origin.get("rpy")))
    out = np.eye(4)
    out[:3, :3] = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    out[:3, 3] = numbers(origin.get("xyz"))
    return out


def link_poses(q: dict[str, float]) -> dict[str, np.ndarray]:
    """(4, 4) of every link in base_link; every joint of R1 moves along or about its z axis."""
    out = {"base_link": np.eye(4)}
    for joint in robot().findall("joint"):  # parents come first in the file
        value, move = q.get(joint.get("name"), 0.0), np.eye(4)
        assert joint.find("axis").get("xyz") == "0 0 1"
        if joint.get("type") == "prismatic":
            move[2, 3] = value
        else:
            move[:2, :2] = [[np.cos(value), -np.sin(value)], [np.sin(value), np.cos(value)]]
        parent = out[joint.find("parent").get("link")]
        out[joint.find("child").get("link")] = parent @ pose(joint.find("origin")) @ move
    return out


def shape_points(link: ET.Element, tag: str) -> list[np.ndarray]:
    """Vertices in the link's frame of each mesh or box of a link."""
    out = []
    for shape in link.findall(tag):
        box, mesh = shape.find("geometry/box"), shape.find("geometry/mesh")
        if box is not None:
            points = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * numbers(box.get("size"))
        else:
            points = mesh_points(mesh.get("filename")) * numbers(mesh.get("scale"), "1 1 1")
        placed = pose(shape.find("origin"))
        out.append(points @ placed[:3, :3].T + placed[:3, 3])
    return out


@functools.cache
def mesh_points(uri: str) -> np.ndarray:
    file = asset_path("r1").parents[1] / uri.removeprefix("package://r1_description/")
    mesh = trimesh.load(file, force="mesh")
    unit = re.search(r'<unit [^>]*meter="([^"]+)"', file.read_text()) if file.suffix == ".dae" else None
    return np.asarray(mesh.vertices) * (float(unit[1]) if unit else 1.0)


def test_links_and_joints_are_those_of_the_configuration() -> None:
    arms = [f"{side}_arm_link{i}" for side in SIDES for i in range(1, 7)]
    fingers = [f"{side}_gripper_link{i}" for side in SIDES for i in (1, 2)]
    wheels = [f"{kind}_link{i}" for kind in ("servo", "wheel") for i in (1, 2, 3)]
    expected = {"base_link", *wheels, *(f"torso_link{i}" for i in range(1, 5)), *arms, *fingers}
    assert {link.get("name") for link in robot().findall("link")} == expected
    names = [joint.get("name") for joint in robot().findall("joint")]
    movable = [name for name in names if not name.startswith(("servo", "wheel"))]
    assert movable == [
        *(f"torso_joint{i}" for i in range(1, 5)),
        *(name for side in SIDES for name in (*(f"{side}_arm_joint{i}" for i in range(1, 7)),
                                              f"{side}_gripper_axis1", f"{side}_gripper_axis2")),
    ]  # fmt: skip
    used = config()
    mentioned = set(used["base_motion"]["wheel_joints"])
    mentioned |= {j for v in used["curobo"]["eef_to_gripper_info"].values() for j in v["joints"]}
    assert mentioned <= set(names)
    assert set(used["curobo"]["collision_spheres"]) <= expected
    assert set(used["collision"]["convex_links"]) <= expected
    types = {j.get("name"): j.get("type") for j in robot().findall("joint")}
    assert {types[f"{kind}_joint{i}"] for kind in ("servo", "wheel") for i in (1, 2, 3)} == {"continuous"}
    assert {types[f"{side}_gripper_axis{i}"] for side in SIDES for i in (1, 2)} == {"prismatic"}


def test_configuration_lies_beside_the_urdf_it_names() -> None:
    path = asset_path("r1")
    assert config()["urdf_path"] == path.name
    package = ET.parse(path.parents[1] / "package.xml").getroot()
    assert package.find("name").text == path.parents[1].name == "r1_description"
    assert len(config()["curobo"]["default_qpos"]) == 20
    assert sum(map(len, config()["curobo"]["collision_spheres"].values())) == 69


def test_ships_with_a_vendors_faults() -> None:
    uris = [mesh.get("filename") for mesh in robot().iter("mesh")]
    assert all(uri.startswith("package://r1_description/meshes/") for uri in uris)
    assert sum(" " in uri for uri in uris) >= 20
    assert sum("(" in uri for uri in uris) >= 10
    assert {uri.rsplit(".", 1)[1] for uri in uris} == {"obj", "stl", "dae"}
    assert [link.get("name") for link in robot().findall("link") if link.find("inertial") is None] == [
        "servo_link2"
    ]
    joints = {j.get("name"): j for j in robot().findall("joint")}
    mimics = {name: j.find("mimic").get("joint") for name, j in joints.items() if j.find("mimic") is not None}
    assert mimics == {f"{side}_gripper_axis2": f"{side}_gripper_axis1" for side in SIDES}
    for side, i in itertools.product(SIDES, (1, 2)):
        limit = joints[f"{side}_gripper_axis{i}"].find("limit").attrib
        assert {k: float(v) for k, v in limit.items()} == {
            "lower": 0,
            "upper": 0.05,
            "effort": 0,
            "velocity": 0,
        }
    dedicated = set()
    for link in robot().findall("link"):
        shown = {m.get("filename") for m in link.findall("visual/geometry/mesh")}
        hit = {m.get("filename") for m in link.findall("collision/geometry/mesh")}
        assert hit or link.find("collision/geometry") is not None
        if hit - shown:
            dedicated.add(link.get("name"))
    assert {"base_link", "torso_link4", "left_gripper_link1", "right_arm_link6"} <= dedicated
    assert not {"left_arm_link2", "torso_link1", "wheel_link1", "servo_link1"} & dedicated


def test_visual_triangles_stay_in_budget() -> None:
    count = 0
    for mesh in robot().findall("link/visual/geometry/mesh"):
        file = asset_path("r1").parents[1] / mesh.get("filename").removeprefix("package://r1_description/")
        count += len(trimesh.load(file, force="mesh").faces)
    assert 20_000 < count < 60_000


@pytest.mark.parametrize("link", sorted(config()["curobo"]["collision_spheres"]))
def test_configured_spheres_lie_in_their_links(link: str) -> None:
    (element,) = (e for e in robot().findall("link") if e.get("name") == link)
    hull = ConvexHull(np.concatenate(shape_points(element, "visual")))
    centers = np.array([s["center"] for s in config()["curobo"]["collision_spheres"][link]])
    outside = (centers @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    assert outside.max() < 1e-6


@pytest.mark.parametrize("name", POSES)
def test_sphere_model_is_free_of_self_collision(name: str) -> None:
    ignored = {
        frozenset((a, b)) for a, others in config()["curobo"]["self_collision_ignore"].items() for b in others
    }
    poses = link_poses(POSES[name] | {f"{side}_gripper_axis{i}": 0.05 for side in SIDES for i in (1, 2)})
    balls = {}
    for link, spheres in config()["curobo"]["collision_spheres"].items():
        centers = np.array([s["center"] for s in spheres]) @ poses[link][:3, :3].T + poses[link][:3, 3]
        balls[link] = centers, np.array([s["radius"] for s in spheres])
    for a, b in itertools.combinations(balls, 2):
        if frozenset((a, b)) not in ignored:
            (p, r), (q, s) = balls[a], balls[b]
            gap = np.linalg.norm(p[:, None] - q[None], axis=2) - r[:, None] - s[None]
            assert gap.min() > 0.004, (a, b, gap.min())


def test_arms_mirror_each_other_and_reach_forward() -> None:
    poses = link_poses(POSES["untucked"])
    for link in [f"arm_link{i}" for i in range(1, 7)]:
        left, right = poses[f"left_{link}"][:3, 3], poses[f"right_{link}"][:3, 3]
        if link in ("arm_link1", "arm_link6"):  # origins on the arm's plane
            np.testing.assert_allclose(left * (1, -1, 1), right, atol=2e-3)
    for side in SIDES:
        hand = poses[f"{side}_arm_link6"]
        np.testing.assert_allclose(hand[:3, 2], (1, 0, 0), atol=2e-3)  # fingers point forward
        assert hand[2, 0] > 0.8  # the hand's camera is on top
        assert 0.35 < hand[0, 3] < 0.6
        assert 1.0 < hand[2, 3] < 1.4
        fingers = [poses[f"{side}_gripper_link{i}"] for i in (1, 2)]
        along_y = [(np.linalg.inv(hand) @ f)[1, 3] for f in fingers]
        assert along_y[0] < 0 < along_y[1]


def test_fingers_open_outwards() -> None:
    hand = "left_arm_link6"
    for i, sign in ((1, -1), (2, 1)):
        closed = link_poses({})
        opened = link_poses({f"left_gripper_axis{i}": 0.05})
        link = f"left_gripper_link{i}"
        moved = np.linalg.inv(closed[hand]) @ (opened[link] - closed[link])
        np.testing.assert_allclose(moved[:3, 3], (0, sign * 0.05, 0), atol=1e-9)


def test_torso_lowers_the_shoulders() -> None:
    high, low = (link_poses(POSES[name])["torso_link4"] for name in ("untucked", "crouching"))
    assert high[2, 3] - low[2, 3] > 0.2
    np.testing.assert_allclose(low[:3, :3], high[:3, :3], atol=1e-9)  # and keeps them upright


def test_limits_hold_the_poses_and_are_usable() -> None:
    for joint in robot().findall("joint"):
        limit = {k: float(v) for k, v in joint.find("limit").attrib.items()}
        name = joint.get("name")
        if "gripper" not in name:
            assert limit["effort"] > 0 < limit["velocity"]
        if joint.get("type") == "revolute":
            for q in POSES.values():
                assert limit["lower"] < q.get(name, 0.0) < limit["upper"]


@pytest.mark.parametrize("name", POSES)
def test_weight_stays_between_the_wheels(name: str) -> None:
    poses, mass, moment = link_poses(POSES[name]), 0.0, np.zeros(3)
    for link in robot().findall("link"):
        inertial = link.find("inertial")
        if inertial is not None:
            m = float(inertial.find("mass").get("value"))
            mass += m
            T = poses[link.get("name")]
            moment += m * (T[:3, :3] @ numbers(inertial.find("origin").get("xyz")) + T[:3, 3])
    assert 60 < mass < 110
    feet = np.array([poses[f"wheel_link{i}"][:2, 3] for i in (1, 2, 3)])
    feet[:, 1] -= 0.03  # the tyre's middle is beside its frame
    hull = ConvexHull(feet)
    inside = -(hull.equations[:, :2] @ (moment / mass)[:2] + hull.equations[:, 2])
    assert inside.min() > 0.03


def test_wheels_touch_the_floor_a_centimetre_below_the_base_frame() -> None:
    poses, lowest = link_poses({}), {}
    for link in robot().findall("link"):
        T = poses[link.get("name")]
        points = np.concatenate(shape_points(link, "visual")) @ T[:3, :3].T + T[:3, 3]
        lowest[link.get("name")] = points[:, 2].min()
    for i in (1, 2, 3):
        assert lowest.pop(f"wheel_link{i}") == pytest.approx(-0.01, abs=2e-4)
    assert min(lowest.values()) > 0.02


def test_eye_camera_looks_out_of_the_head() -> None:
    (eyes,) = (c for c in config()["camera_links"] if c["link"] == "eyes")
    x, y, z = eyes["offset"]["position"]
    (link,) = (e for e in robot().findall("link") if e.get("name") == eyes["parent_link"])
    points = np.concatenate(shape_points(link, "visual"))
    near = points[(np.abs(points[:, 1] - y) < 0.05) & (np.abs(points[:, 2] - z) < 0.05)]
    assert len(near) > 20
    assert near[:, 0].max() < x

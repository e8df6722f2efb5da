"""Merged fixed links and mirrored meshes keep the mass, motion and surface of the source file."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from roboyard import import_robot, load_description
from roboyard.importer.pipeline import ImportResult
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.sim import World

INERTIAL = """<inertial><origin xyz="{xyz}" rpy="{rpy}"/><mass value="{mass}"/>
  <inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0.0002" ixz="-0.0001" iyz="0.0003"/></inertial>"""
SHAPE = """<{kind}><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{geometry}</geometry></{kind}>"""


def link(
    name: str, mass: float, *, xyz: str = "0.01 0.02 0.03", rpy: str = "0.1 0.2 0.3", more: str = ""
) -> str:
    numbers = {"ixx": 0.011 * mass, "iyy": 0.012 * mass, "izz": 0.013 * mass}
    inertial = INERTIAL.format(xyz=xyz, rpy=rpy, mass=mass, **numbers)
    box = '<box size="0.1 0.06 0.04"/>'
    shapes = "".join(SHAPE.format(kind=k, xyz=xyz, rpy=rpy, geometry=box) for k in ("visual", "collision"))
    return f'<link name="{name}">{inertial}{shapes}{more}</link>'


def joint(name: str, kind: str, parent: str, child: str, xyz: str, rpy: str = "0 0 0") -> str:
    limit = '<limit lower="-2" upper="2" effort="20" velocity="3"/>' if kind != "fixed" else ""
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="0 0.6 0.8"/>{limit}</joint>'
    )


CHAIN = "".join(
    (
        link("base", 5.0),
        link("plate", 0.7),
        link("upper", 2.0),
        link("bracket", 0.4),
        link("adapter", 0.2),
        link("lower", 1.5),
        link("camera", 0.1),
        joint("mount", "fixed", "base", "plate", "0.1 0 0.2", "0.3 0 0.5"),
        joint("shoulder", "revolute", "plate", "upper", "0 0.1 0.1", "0 0.4 0"),
        joint("bracket_joint", "fixed", "upper", "bracket", "0.2 0 0", "0 0 0.7"),
        joint("adapter_joint", "fixed", "bracket", "adapter", "0 0.05 0.1", "0.2 0 0"),
        joint("elbow", "revolute", "adapter", "lower", "0.1 0 0.1"),
        joint("camera_joint", "fixed", "lower", "camera", "0 0 0.3", "0 -0.5 0"),
    )
)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "chain.urdf"
    path.write_text(f'<robot name="chain">{CHAIN}</robot>')
    return path


def imported(file: Path, out: Path, **config: object) -> ImportResult:
    given = {"name": "chain", "canonical_frame": False, **config}
    return import_robot(file, config=given, out=out, validate=False, report=False)


def mass_matrix(file: Path, positions: dict[str, float]) -> np.ndarray:
    """(2, 2) joint-space inertia of the robot with a fixed base, by MuJoCo."""
    world = World()
    body = world.add_urdf(file, fixed_base=True)
    for name, value in positions.items():
        body.joint(name).position = value
    model, data = world.model, world.data
    model.dof_armature[:] = 0.0
    mujoco.mj_forward(model, data)
    dense = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, dense)
    return dense


@pytest.fixture
def merged(file: Path, tmp_path: Path) -> Path:
    return imported(file, tmp_path / "data", merge_fixed_joints=True).folder / "urdf" / "chain.urdf"


def test_only_moving_joints_are_left(merged: Path) -> None:
    description = load_description(merged)
    assert [link.name for link in description.links] == ["base", "upper", "lower"]
    assert [(j.name, j.parent, j.child) for j in description.joints] == [
        ("shoulder", "base", "upper"),
        ("elbow", "upper", "lower"),
    ]


def test_mass_and_centre_of_mass_are_kept(file: Path, merged: Path) -> None:
    def whole(path: Path) -> tuple[float, np.ndarray]:
        description = load_description(path)
        poses = forward_kinematics(description, {"shoulder": 0.4, "elbow": -0.7})
        total, moment = 0.0, np.zeros(3)
        for part in description.links:
            assert part.inertial is not None
            center = poses[part.name] @ [*part.inertial.origin.position, 1.0]
            total += part.inertial.mass
            moment += part.inertial.mass * center[:3]
        return total, moment / total

    before, after = whole(file), whole(merged)
    assert after[0] == pytest.approx(before[0], rel=1e-9)
    np.testing.assert_allclose(after[1], before[1], atol=1e-9)


@pytest.mark.parametrize(
    "positions", [{}, {"shoulder": 0.8, "elbow": -1.1}, {"shoulder": -1.7, "elbow": 1.9}]
)
def test_joint_inertia_is_kept(file: Path, merged: Path, positions: dict[str, float]) -> None:
    np.testing.assert_allclose(mass_matrix(merged, positions), mass_matrix(file, positions), rtol=1e-6)


def test_shapes_keep_their_place(file: Path, merged: Path) -> None:
    def centres(path: Path) -> np.ndarray:
        description = load_description(path)
        poses = forward_kinematics(description, {"shoulder": 0.3, "elbow": 0.9})
        found = [
            (poses[part.name] @ [*visual.origin.position, 1.0])[:3]
            for part in description.links
            for visual in part.visuals
        ]
        return np.array(sorted(np.round(found, 9).tolist()))

    np.testing.assert_allclose(centres(merged), centres(file), atol=1e-8)


def test_links_of_sensors_are_not_merged(file: Path, tmp_path: Path) -> None:
    result = imported(file, tmp_path / "data", merge_fixed_joints=True, camera_links=[{"link": "camera"}])
    names = [part.name for part in load_description(result.folder / "urdf" / "chain.urdf").links]
    assert "camera" in names and "bracket" not in names


def test_links_of_the_planner_are_not_merged(file: Path, tmp_path: Path) -> None:
    planner = {"eef_to_gripper_info": {"adapter": {"links": [], "joints": []}}}
    result = imported(file, tmp_path / "data", merge_fixed_joints=True, curobo=planner)
    names = [part.name for part in load_description(result.folder / "urdf" / "chain.urdf").links]
    assert "adapter" in names and "bracket" not in names and "camera" not in names


def test_merging_is_off_by_default(file: Path, tmp_path: Path) -> None:
    result = imported(file, tmp_path / "data")
    assert len(load_description(result.folder / "urdf" / "chain.urdf").links) == 7


# ------------------------------------------------------------------------------------------- mirrored meshes


@pytest.fixture
def wedge(tmp_path: Path) -> Path:
    """A mesh without any mirror symmetry."""
    corners = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    path = tmp_path / "wedge.stl"
    trimesh.Trimesh(corners, faces).export(path)
    return path


@pytest.mark.parametrize("scale", ["-1 1 1", "1 -2 1", "-1 -1 1", "-0.5 -1 -2"])
def test_mirrored_meshes_keep_their_surface_with_positive_scale(
    tmp_path: Path, wedge: Path, scale: str
) -> None:
    mesh = f'<mesh filename="{wedge.name}" scale="{scale}"/>'
    shape = SHAPE.format(kind="visual", xyz="0.1 0 0", rpy="0 0 0", geometry=mesh)
    file = tmp_path / "chain.urdf"
    file.write_text(f'<robot name="chain">{link("base", 1.0, more=shape)}</robot>')
    result = imported(file, tmp_path / "data")
    base = load_description(result.folder / "urdf" / "chain.urdf").root
    geometry = base.visuals[-1].geometry
    assert min(geometry.scale) > 0
    found = trimesh.load_mesh(geometry.path)
    found.merge_vertices()
    factors = np.array([float(word) for word in scale.split()])
    source = trimesh.load_mesh(wedge)
    expected = np.unique(np.round(source.vertices * factors, 6), axis=0)
    np.testing.assert_allclose(
        np.unique(np.round(found.vertices * geometry.scale, 6), axis=0), expected, atol=1e-6
    )
    assert found.volume == pytest.approx(
        abs(source.volume * np.prod(factors)), rel=1e-5
    )  # faces point outwards

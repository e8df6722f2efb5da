"""Robots whose names carry ROS name spaces keep them in every file."""

import numpy as np
import pytest
import yaml

from roboyard import import_robot
from roboyard.sim import World

INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>'
)
LINK = f"""<link name="{{}}">{INERTIAL}
  <visual><geometry><mesh filename="{{}}.stl"/></geometry></visual></link>"""
LINKS = ("r2/base", "r2/arm/upper", "r2/arm_upper")
JOINTS = ("r2/arm/joint0", "r2/arm_joint0")


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    trimesh = pytest.importorskip("trimesh")
    folder = tmp_path_factory.mktemp("spaces")
    for k, size in enumerate(((0.3, 0.3, 0.1), (0.1, 0.1, 0.3), (0.05, 0.05, 0.2))):
        trimesh.creation.box(size).export(folder / f"part{k}.stl")
    text = "".join(LINK.format(name, f"part{k}") for k, name in enumerate(LINKS))
    for k, joint in enumerate(JOINTS):
        text += f"""<joint name="{joint}" type="revolute">
          <parent link="{LINKS[k]}"/><child link="{LINKS[k + 1]}"/>
          <origin xyz="0 0 0.25"/><axis xyz="0 1 0"/>
          <limit lower="-1" upper="1" effort="10" velocity="1"/></joint>"""
    (folder / "r2.urdf").write_text(f'<robot name="r2">{text}</robot>')
    return import_robot(folder / "r2.urdf", name="r2", out=folder / "data")


def test_stock_mujoco_has_the_names(imported):
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(imported.folder / "mjcf" / "r2.xml"))
    assert {model.body(k).name for k in range(1, model.nbody)} >= set(LINKS)
    assert [model.joint(name).name for name in JOINTS] == list(JOINTS)
    assert model.body_mass.sum() == pytest.approx(3.0)


def test_the_planner_and_the_definition_have_the_names(imported):
    robot = yaml.safe_load((imported.folder / "curobo" / "r2_description_curobo_default.yaml").read_text())
    assert robot["robot_cfg"]["cspace"] == list(JOINTS)
    assert set(robot["robot_cfg"]["collision_spheres"]) == set(LINKS)
    assert "r2/arm" in imported.definition.read_text()


def test_links_alike_but_for_the_slash_keep_their_own_hulls(imported):
    from roboyard.description.loader import load_description

    links = load_description(imported.folder / "urdf" / "r2.urdf").links
    assert [link.name for link in links] == list(LINKS)
    heights = [np.ptp(_vertices(link.collisions[0].geometry.path)[:, 2]) for link in links]
    assert heights == pytest.approx([0.1, 0.3, 0.2], abs=1e-6)


def test_usd_keeps_the_names_beside_its_own(imported):
    pxr = pytest.importorskip("pxr")
    stage = pxr.Usd.Stage.Open(str(imported.folder / "usd" / "r2.usda"))
    bodies = [p for p in stage.Traverse() if p.HasAPI(pxr.UsdPhysics.RigidBodyAPI)]
    assert {p.GetDisplayName() or p.GetCustomDataByKey("urdf_name") for p in bodies} == set(LINKS)


def test_the_world_takes_it(imported):
    world = World()
    robot = world.add_urdf(imported.folder / "urdf" / "r2.urdf")
    assert list(robot.joint_names) == list(JOINTS)


def _vertices(path):
    rows = [line.split()[1:4] for line in path.read_text().splitlines() if line.startswith("v ")]
    return np.array(rows, dtype=float)


def test_kept_names_and_filtered_overlaps_are_nothing_to_look_at(tmp_path):
    """Both are resolved: the USD writer makes its own names, and the collision of overlapping links is
    disabled.
    """
    box = '<collision><geometry><box size=".2 .2 .2"/></geometry></collision>'
    links = "".join(f'<link name="{k}">{INERTIAL}{box}</link>' for k in "012")
    joints = "".join(
        f"""<joint name="j-{k}" type="revolute"><parent link="{k}"/><child link="{k + 1}"/>
        <origin xyz="0 0 0.08"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" effort="9" velocity="1"/></joint>"""
        for k in (0, 1)
    )
    (tmp_path / "stack.urdf").write_text(f'<robot name="stack">{links}{joints}</robot>')
    made = import_robot(tmp_path / "stack.urdf", name="stack", out=tmp_path / "data")
    assert ("0", "2") in made.robot.semantic.disabled_collision_pairs
    messages = " ".join(warning.message for warning in made.warnings)
    assert "[collision-overlap]" not in messages
    assert "[joint-name-odd]" not in messages and "[link-name-odd]" not in messages

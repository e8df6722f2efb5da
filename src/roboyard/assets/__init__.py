"""The bundled robots and household objects: URDFs, meshes and textures, all made by Roboyard's own generator.

`tools/make_assets.py` in the repository writes every file here. R1 ships twice: as a vendor would publish it
(`r1/r1_description`, to be imported) and as the finished package that the import makes (`r1/urdf`, `r1/mjcf`,
`r1/curobo`), which `add_robot(world, "r1")` loads.
"""

from __future__ import annotations

from pathlib import Path

from roboyard.errors import RoboyardError, unknown_name

ROBOTS: dict[str, str] = {
    "arm7": "arm7/arm7.urdf",
    "cartpole": "cartpole.urdf",
    "husky": "husky/husky.urdf",
    "r1": "r1/r1_description/urdf/r1_pro_source.urdf",
    "r2d2": "r2d2.urdf",
    "rover": "rover/rover.urdf",
    "walker": "walker/walker.urdf",
}
"""File of each bundled robot, relative to the assets folder."""

OBJECTS: dict[str, str] = {
    "block": "block.urdf",
    "cube": "cube.urdf",
    "cube_small": "cube_small.urdf",
    "jenga": "jenga/jenga.urdf",
    "plane": "plane.urdf",
    "plane100": "plane100.urdf",
    "sphere2": "sphere2.urdf",
    "sphere_small": "sphere_small.urdf",
    "table": "table/table.urdf",
    "tray": "tray/traybox.urdf",
}
"""File of each bundled object that is not a robot."""

STAND_INS: tuple[str, ...] = (
    "domino/domino.urdf",
    "duck_vhacd.urdf",
    "franka_panda/panda.urdf",
    "humanoid/humanoid.urdf",
    "kuka_iiwa/kuka_with_gripper.sdf",
    "kuka_iiwa/kuka_with_gripper2.sdf",
    "kuka_iiwa/model.urdf",
    "lego/lego.urdf",
    "quadruped/minitaur.urdf",
    "racecar/racecar.urdf",
    "table_square/table_square.urdf",
    "tray/tray.urdf",
)
"""Models of primitives under the names, with the joints and masses of those of PyBullet's data."""

SOURCE_CONFIGS: dict[str, str] = {"r1": "r1/r1_description/urdf/r1_source_config.yaml"}
"""Import configuration of each robot that also ships as a finished package, relative to the assets folder."""


def assets_root() -> Path:
    """Return the folder of the bundled files.

    Search here to find `plane.urdf` or `husky/husky.urdf` by name.
    """
    return Path(__file__).resolve().parent


def asset_path(name: str) -> Path:
    """Return the path of a bundled URDF by short name, or of any bundled file by its path in the folder.

    Args:
        name: a key of `ROBOTS` or `OBJECTS` ("r1", "plane"), or a path such as "husky/husky.urdf".

    Raises:
        RoboyardError: no bundled file has that name; the message lists the names.
    """
    root = assets_root()
    known = ROBOTS | OBJECTS
    path = (root / known.get(name, name)).resolve()
    if path.is_file() and path.is_relative_to(root):
        return path
    raise RoboyardError(unknown_name("bundled robot or object", name, known))

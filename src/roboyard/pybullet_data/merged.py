"""One folder of PyBullet's data: the bundled files and those of an installed `pybullet_data`, as links.

Scripts join paths with the folder, open files in it and search there, so it has to be a real one. It holds
a link for each file or folder that only one side has. It is made once for a pair of installations, in the
user's cache.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from importlib.machinery import PathFinder
from pathlib import Path

from roboyard._bootstrap import user_cache
from roboyard._digests import blake2b

PACKAGE = "pybullet_data"
DISTRIBUTION = "pybullet"
"""Distribution that contains `pybullet_data`."""

EQUAL = frozenset({"cube.urdf", "plane.urdf", "sphere_small.urdf"})
"""Bundled files with PyBullet's masses, inertias, friction and shapes; others stand in for PyBullet's where
these are not installed."""

NAMES = frozenset(
    """
    TwoJointRobot_w_fixedJoints.urdf TwoJointRobot_wo_fixedJoints.urdf a1 aliengo bicycle biped
    block.urdf bunny.obj cartpole.urdf checker_blue.png checker_grid.jpg cloth_z_up.obj cloth_z_up.urdf
    cube.obj cube.urdf cube_collisionfilter.urdf cube_no_rotation.urdf cube_rotate.urdf cube_small.urdf
    differential domino duck.obj duck_vhacd.obj duck_vhacd.urdf franka_panda gripper heightmaps humanoid
    husky jenga kiva_shelf kuka_iiwa laikago lego mini_cheetah mjcf objects pendulum5.urdf plane.obj
    plane.urdf plane100.urdf plane_implicit.urdf plane_stadium.sdf plane_transparent.urdf policies
    pr2_gripper.urdf quadruped r2d2.urdf racecar random_urdfs roboschool samurai.urdf
    samurai_monastry.obj soccerball.urdf sphere2.urdf sphere2red.urdf sphere2red_nocol.urdf
    sphere8cube.urdf sphere_1cm.urdf sphere_small.urdf sphere_transparent.urdf
    sphere_with_restitution.urdf spherical_joint_limit.urdf stadium.sdf stadium_no_collision.sdf
    stone.obj table table_square teddy_large.urdf teddy_vhacd.urdf terrain.obj testdata tex256.png torus
    torus_deform.urdf toys tray urdf uvmap.png xarm
    """.split()  # noqa: SIM905
)
"""First part of the paths of the files in PyBullet 3.2.7's `pybullet_data`."""


def installed_data() -> Path | None:
    """Return the folder of an installed `pybullet_data`, also where another module has its name, or None."""
    found = PathFinder.find_spec(PACKAGE, sys.path)
    if found is None or not found.submodule_search_locations:
        return None
    folder = Path(next(iter(found.submodule_search_locations)))
    return folder if folder.is_dir() else None


def merged_folder(ours: Path, theirs: Path) -> Path:
    """Return the folder with the files of both, made on first use.

    Of a file that both have, ours is taken if it is in `EQUAL`, else theirs. `ours` alone is returned where
    no folder can be written or the system allows no links.

    Args:
        ours: folder of the bundled files.
        theirs: folder of an installed `pybullet_data`.
    """
    stamp = "\0".join(f"{folder}\0{folder.stat().st_mtime_ns}" for folder in (ours, theirs))
    name = f"pybullet_data-{blake2b(stamp.encode(), digest_size=8).hexdigest()}"
    for parent in _cache_folders():
        target = parent / name
        if target.is_dir():
            return target
        import shutil
        import tempfile  # both take longer to import than the rest of this

        try:
            parent.mkdir(parents=True, exist_ok=True)
            made = Path(tempfile.mkdtemp(prefix=f"{name}-", dir=parent))
        except OSError:
            continue
        try:
            _merge(ours, theirs, made, "")
            made.chmod(0o755)
            made.rename(target)
        except OSError:
            shutil.rmtree(made, ignore_errors=True)
            if target.is_dir():  # another process was first
                return target
            continue
        return target
    return ours


def missing_file_remedy(name: str) -> str | None:
    """Return which package brings a file that was not found, or None for a file of no known package.

    Args:
        name: as a script gives it, a path under `getDataPath()` or an absolute one there.
    """
    parts = Path(name).parts
    known = next((i for i, part in enumerate(parts) if part in NAMES), None)
    if known is None:
        return None
    file = "/".join(parts[known:])
    if installed_data() is None:
        return (
            f"`pip install {DISTRIBUTION}` brings pybullet_data with {file!r}; Roboyard then finds it there"
        )
    return f"neither Roboyard nor the installed pybullet_data has {file!r}; another release may"


def _cache_folders() -> Iterator[Path]:
    yield Path(user_cache())
    import tempfile

    user = getattr(os, "getuid", lambda: 0)()
    yield Path(tempfile.gettempdir()) / f"roboyard-{user}"


def _merge(ours: Path, theirs: Path, target: Path, inside: str) -> None:
    """Link the entries of two folders into `target`; folders of both become folders."""
    own, other = (
        {
            entry.name: entry
            for entry in folder.iterdir()
            if entry.suffix != ".py" and entry.name != "__pycache__"
        }
        for folder in (ours, theirs)
    )
    for name in sorted(own.keys() | other.keys()):
        mine, its = own.get(name), other.get(name)
        if mine is not None and its is not None and mine.is_dir() and its.is_dir():
            (target / name).mkdir()
            _merge(mine, its, target / name, f"{inside}{name}/")
            continue
        chosen = mine if its is None or (mine is not None and inside + name in EQUAL) else its
        assert chosen is not None
        _link(chosen, target / name)


def _link(source: Path, target: Path) -> None:
    """Link a file or folder; where symbolic links are not allowed, by hard links of its files.

    Raises:
        OSError: the system allows neither.
    """
    try:
        target.symlink_to(source, target_is_directory=source.is_dir())
    except OSError:
        if source.is_dir():
            target.mkdir()
            for entry in source.iterdir():
                _link(entry, target / entry.name)
        else:
            os.link(source, target)

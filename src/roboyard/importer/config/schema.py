"""The source configuration of an import: every key, typed.

This is the file that OmniGibson's importer takes. Unlike there, a key that does not exist, a value of the
wrong type and an impossible number are errors; `load_config` reports all of them at once with their lines.
`roboyard import --help` shows the whole file with comments.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_validator,
)

from roboyard.description.semantic import BaseKind, Opening, RobotKind
from roboyard.paths import DEFAULT_DATASET

NAME_PATTERN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
DecomposeMethod = Literal["coacd", "convex"]
SpherePreset = Literal["balanced", "tight", "safe"]


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError("must be a finite number")
    return float(value)


def _number(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("must be a number")
    return value


def _unit(value: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    length = math.sqrt(sum(part * part for part in value))
    if length < 1e-6:
        raise ValueError("has no length and so is no rotation; use [0, 0, 0, 1] for none")
    return (value[0] / length, value[1] / length, value[2] / length, value[3] / length)


def _positive(value: float) -> float:
    if not value > 0:
        raise ValueError("must be positive")
    return value


def _no_repeats(value: list[str]) -> list[str]:
    for name in value:
        if value.count(name) > 1:
            raise ValueError(f"{name!r} is listed twice")
    return value


def _none_as_empty(value: Any) -> Any:
    """A key without a value (`coacd_links:`) means an empty list or mapping."""
    return [] if value is None else value


def _none_as_empty_map(value: Any) -> Any:
    return {} if value is None else value


Number = Annotated[float, AfterValidator(_finite), BeforeValidator(_number)]
Length = Annotated[Number, AfterValidator(_positive)]
Names = Annotated[list[str], AfterValidator(_no_repeats), BeforeValidator(_none_as_empty)]
Vector = tuple[Number, Number, Number]
Quaternion = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=False, hide_input_in_errors=True)


class BaseMotion(_Section):
    """Motion of the base."""

    wheel_links: Names = []
    """Links that are wheels."""
    wheel_joints: Names = []
    """Joints that are fixed when the base becomes holonomic."""
    use_sphere_wheels: bool = False
    """Collide wheels as their bounding spheres."""
    use_holonomic_joints: bool = False
    """Fix the wheel joints and move the base by six virtual joints, of which x, y and rz are driven."""


class Collision(_Section):
    """Method for collision shapes. Links with usable ones keep them unless a list names them."""

    decompose_method: DecomposeMethod | None = "convex"
    """Method for links whose collision shape is missing or is their visual mesh; null for none."""
    hull_count: Annotated[int, Field(ge=1, le=512, strict=True)] = 8
    """Largest number of hulls of a mesh, for coacd."""
    coacd_links: Names = []
    convex_links: Names = []
    no_decompose_links: Names = []
    no_collision_links: Names = []


class Offset(_Section):
    """Pose in the parent's frame; in the link's without a parent."""

    position: Vector = (0.0, 0.0, 0.0)
    """Applied before the rotation (m)."""
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """x, y, z, w"""


class SensorLink(_Section):
    """A camera, lidar or marker on a link, or on a new link below `parent_link`."""

    link: Annotated[str, Field(min_length=1)]
    parent_link: str | None = None
    offset: Annotated[Offset, BeforeValidator(_none_as_empty_map)] = Offset()


Sensors = Annotated[list[SensorLink], BeforeValidator(_none_as_empty)]


class Gripper(_Section):
    """The gripper that belongs to an end effector."""

    links: Names = []
    joints: Names = []


class Sphere(_Section):
    """One collision sphere in its link's frame; m."""

    center: Vector
    radius: Length


class Curobo(_Section):
    """Settings of the motion planner; missing ones are computed."""

    eef_to_gripper_info: Annotated[dict[str, Gripper], BeforeValidator(_none_as_empty_map)] = {}
    flip_joint_limits: Names = []
    lock_joints: Annotated[dict[str, Number | None], BeforeValidator(_none_as_empty_map)] = {}
    self_collision_ignore: Annotated[dict[str, Names], BeforeValidator(_none_as_empty_map)] = {}
    self_collision_buffer: Annotated[dict[str, Number], BeforeValidator(_none_as_empty_map)] = {}
    """Link name to padding (m)."""
    collision_spheres: Annotated[dict[str, list[Sphere]], BeforeValidator(_none_as_empty_map)] = {}
    """A mapping, or a list of one-key mappings as Lula's editor exports."""
    torso_joints: Names = []
    default_qpos: list[Number] | dict[str, Number] | None = None
    """Position of each moving joint except the virtual ones, breadth first; or by name (rad or m)."""
    sphere_preset: SpherePreset = "balanced"
    """Preset for fitting collision spheres where none are given."""

    @field_validator("collision_spheres", mode="before")
    @classmethod
    def _merge_lula(cls, value: Any) -> Any:
        if not isinstance(value, list):
            return value
        merged: dict[Any, Any] = {}
        for item in value:
            if not isinstance(item, dict) or len(item) != 1:
                raise ValueError("a list must hold one-key mappings (link name: spheres)")
            for link, spheres in item.items():
                if link in merged:
                    raise ValueError(f"link {link!r} is given twice")
                merged[link] = spheres
        return merged


OptionalNames = Annotated[list[str] | None, AfterValidator(lambda names: names and _no_repeats(names))]


class Understanding(_Section):
    """Kind and parts of the robot. A missing key is inferred; a given one replaces what is inferred."""

    kind: RobotKind | None = None
    base: BaseKind | None = None
    steer_joints: OptionalNames = None
    caster_joints: OptionalNames = None
    head_joints: OptionalNames = None
    legs: dict[str, Names] | None = None
    """Name to joints, from the body outwards."""
    arms: dict[str, Names] | None = None
    """Name to joints, from the base outwards."""
    opening: dict[str, Opening] | None = None
    """Arm's name, or the palm of a hand on its own, to the direction of the joints that opens."""
    imu_links: OptionalNames = None


def _any_file_name(value: Any, check: ValidatorFunctionWrapHandler) -> Any:
    """Accept file names that are not UTF-8, which Python has with surrogates."""
    if isinstance(value, str) and any("\ud800" <= character <= "\udfff" for character in value):
        return value
    return check(value)


class ImportConfig(_Section):
    """A whole source configuration."""

    urdf_path: Annotated[str, Field(min_length=1), WrapValidator(_any_file_name)]
    """Path of the URDF, relative to the configuration's folder or absolute."""
    name: str
    xacro_args: dict[str, str] = {}
    """Values of `<xacro:arg>` by name, where `urdf_path` is a xacro file."""
    dataset_name: str = DEFAULT_DATASET
    headless: bool = True
    overwrite: bool = False
    merge_fixed_joints: bool = False
    canonical_frame: bool = True
    """Move the root link's origin to the bottom of the robot."""
    missing_meshes: Literal["warn", "error"] | None = None
    """Whether shapes whose mesh file is missing are omitted with a warning, or are an error; by default
    visual shapes are omitted and collision shapes are an error.
    """
    category: str = "robot"
    base_motion: Annotated[BaseMotion, BeforeValidator(_none_as_empty_map)] = BaseMotion()
    collision: Annotated[Collision, BeforeValidator(_none_as_empty_map)] = Collision()
    eef_vis_links: Sensors = []
    camera_links: Sensors = []
    lidar_links: Sensors = []
    understanding: Annotated[Understanding, BeforeValidator(_none_as_empty_map)] = Understanding()
    curobo: Annotated[Curobo, BeforeValidator(_none_as_empty_map)] = Curobo()

    @field_validator("name")
    @classmethod
    def _plain_name(cls, value: str) -> str:
        return checked_name(value)

    @field_validator("dataset_name")
    @classmethod
    def _one_folder(cls, value: str) -> str:
        return checked_dataset(value)

    def urdf_file(self, folder: Path) -> Path:
        """Return the URDF's path; `folder` is that of the configuration."""
        path = Path(self.urdf_path).expanduser()
        return path if path.is_absolute() else folder / path


def checked_name(value: str) -> str:
    """Return a robot name in lower case.

    Raises:
        ValueError: it is not usable as name of a prim and a folder.
    """
    if len(value) > 100 or not NAME_PATTERN.fullmatch(value):
        raise ValueError(f"{value!r} is no robot name; use letters, digits and _, not starting with a digit")
    return value.lower()


def checked_dataset(value: str) -> str:
    """Return a dataset's folder name.

    Raises:
        ValueError: it is not the name of one folder.
    """
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}", value):
        raise ValueError(f"{value!r} is no folder name; use letters, digits, '_', '-' and '.'")
    return value

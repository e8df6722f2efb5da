"""The stage as a whole: units, default prim, metadata; writes the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.errors import MissingExtraError
from roboyard.formats.written import Written

if TYPE_CHECKING:
    from roboyard.importer.model import ImportedRobot


def write(
    robot: ImportedRobot,
    path: Path | str,
    *,
    textures: Path | str | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Written:
    """Write a robot as one USD layer; images go beside it.

    Args:
        robot: what to write.
        path: `.usda` (or `.usd`, `.usdc` for binary).
        textures: folder for images; `material` beside the file by default. The layer names them relatively.
        metadata: `bbox_size`, `base_link_offset` (3 floats each, m) for `ig:nativeBB`, `ig:offsetBaseLink`;
            everything else becomes the custom data `metadata`. What is absent is measured or left empty.

    Raises:
        MissingExtraError: OpenUSD is not installed.
        MeshError: a mesh file cannot be read.
    """
    try:
        import pxr  # noqa: F401
    except ImportError:
        raise MissingExtraError("OpenUSD", "usd", "writing USD") from None
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(textures) if textures is not None else target.parent / "material"
    stage, images, notes = _build(robot, target.parent, folder, metadata or {})
    if not stage.GetRootLayer().Export(str(target)):
        raise OSError(f"{target}: OpenUSD could not write it")
    return Written(files=(target, *images), notes=notes)


def _build(
    robot: ImportedRobot, layer_folder: Path, textures: Path, metadata: Mapping[str, Any]
) -> tuple[Any, tuple[Path, ...], tuple[str, ...]]:
    from pxr import Sdf, Usd, UsdGeom

    from roboyard.formats.usd.geometry import Masters
    from roboyard.formats.usd.joints import add_joints
    from roboyard.formats.usd.links import add_filtered_pairs, add_links
    from roboyard.formats.usd.materials import Looks
    from roboyard.formats.usd.naming import paths_of
    from roboyard.formats.usd.sensors import add_sensors

    stage = Usd.Stage.CreateInMemory()
    paths = paths_of(robot)
    notes: list[str] = []
    _write_units(stage)
    root = UsdGeom.Xform.Define(stage, Sdf.Path(paths.root)).GetPrim()
    stage.SetDefaultPrim(root)
    looks = Looks(stage=stage, root=paths.root, layer_folder=layer_folder, texture_folder=textures)
    add_links(stage, robot, paths, Masters(stage=stage), looks, notes)
    add_joints(stage, robot, paths, notes)
    add_filtered_pairs(stage, robot, paths)
    add_sensors(stage, robot, paths)
    _write_metadata(root, robot, metadata)
    _add_scene(stage)
    return stage, tuple(looks.textures.values()), (*notes, *looks.notes)


def _write_units(stage: Any) -> None:
    from pxr import UsdGeom, UsdPhysics

    from roboyard import __version__

    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.GetRootLayer().customLayerData = {"creator": f"Roboyard {__version__}"}


def _write_metadata(root: Any, robot: ImportedRobot, metadata: Mapping[str, Any]) -> None:
    from pxr import Sdf

    from roboyard.formats.geometry import visual_bounds
    from roboyard.formats.usd.values import place, set_attribute, vec3f

    place(root, (0, 0, 0), (0, 0, 0, 1))
    rest = dict(metadata)
    size, offset = rest.pop("bbox_size", None), rest.pop("base_link_offset", None)
    if size is None or offset is None:
        bounds = visual_bounds(robot.description)
        size = size if size is not None else (0, 0, 0) if bounds is None else bounds[1] - bounds[0]
        offset = offset if offset is not None else (0, 0, 0) if bounds is None else bounds.mean(axis=0)
    kinds = Sdf.ValueTypeNames
    set_attribute(root, "ig:nativeBB", kinds.Vector3f, vec3f(size))
    set_attribute(root, "ig:offsetBaseLink", kinds.Vector3f, vec3f(offset))
    set_attribute(root, "ig:category", kinds.String, robot.category)
    set_attribute(root, "ig:model", kinds.String, robot.name)
    kept = {"meta_links": {}, "link_tags": {}, "object_parts": [], "orientations": [], **rest}
    root.SetCustomDataByKey("metadata", {key: _custom(value) for key, value in kept.items()})


def _custom(value: Any) -> Any:
    """A JSON value as custom data: None is `none`, an empty list an empty vector array, a list of objects
    an object keyed "0", "1", ..., nested lists of 2 to 4 numbers vector arrays, others typed arrays.
    """
    from pxr import Gf, Vt

    if value is None:
        return "none"
    if isinstance(value, Mapping):
        return {str(key): _custom(item) for key, item in value.items()}
    if not isinstance(value, Sequence) or isinstance(value, str):
        return value
    if not value:
        return Vt.Vec3fArray()
    if all(isinstance(item, Mapping) for item in value):
        return {str(k): _custom(item) for k, item in enumerate(value)}
    if all(isinstance(item, Sequence) and not isinstance(item, str) for item in value):
        sizes = {len(item) for item in value}
        kinds = {
            2: (Gf.Vec2f, Vt.Vec2fArray),
            3: (Gf.Vec3f, Vt.Vec3fArray),
            4: (Gf.Vec4f, Vt.Vec4fArray),
        }
        if len(sizes) == 1 and (size := sizes.pop()) in kinds:
            vector, array = kinds[size]
            return array([vector(*map(float, item)) for item in value])
        return {str(k): _custom(item) for k, item in enumerate(value)}
    if all(isinstance(item, int) and not isinstance(item, bool) for item in value):
        return Vt.IntArray(list(value))
    if all(isinstance(item, int | float) for item in value):
        return Vt.DoubleArray([float(item) for item in value])
    return Vt.StringArray([str(item) for item in value])


def _add_scene(stage: Any) -> None:
    from pxr import Gf, UsdPhysics

    scene = UsdPhysics.Scene.Define(stage, "/physicsScene")
    scene.CreateGravityDirectionAttr(Gf.Vec3f(0.0, 0.0, -1.0))
    scene.CreateGravityMagnitudeAttr(9.81)

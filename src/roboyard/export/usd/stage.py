"""The stage as a whole: units, default prim, metadata, world."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard._version import __version__
from roboyard.export.usd.geometry import MeshPrototypes
from roboyard.export.usd.joints import add_joints
from roboyard.export.usd.library import Gf, Sdf, Usd, UsdGeom, UsdPhysics, Vt
from roboyard.export.usd.links import add_filtered_pairs, add_links
from roboyard.export.usd.loops import add_loops
from roboyard.export.usd.materials import MaterialWriter
from roboyard.export.usd.naming import paths_of
from roboyard.export.usd.sensors import add_sensors
from roboyard.export.usd.values import place, set_attribute, vec3f

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


@dataclass(frozen=True, kw_only=True, slots=True)
class Built:
    """A robot's stage, not yet on disk."""

    stage: Any
    """Its root layer holds everything but the meshes."""
    meshes: Any
    """Sublayer with the meshes."""
    images: tuple[Path, ...]
    """Written already."""
    notes: tuple[str, ...]

    def save(self, path: Path) -> tuple[Path, ...]:
        """Write `path` and, beside it, `<stem>_meshes.usdc`; returns both."""
        beside = path.with_name(f"{path.stem}_meshes.usdc")
        top = Sdf.Layer.CreateAnonymous()
        top.TransferContent(self.stage.GetRootLayer())
        top.subLayerPaths = [f"./{beside.name}"]
        for layer, file in ((self.meshes, beside), (top, path)):
            if not layer.Export(str(file)):
                raise OSError(f"{file}: OpenUSD could not write it")
        return path, beside


def build(robot: RobotModel, layer_folder: Path, textures: Path) -> Built:
    """The stage of a robot.

    Args:
        robot: what to show.
        layer_folder: where the layer will lie; assets are named relative to it.
        textures: folder that gets the images.
    """
    stage = Usd.Stage.CreateInMemory()
    meshes = Sdf.Layer.CreateAnonymous("meshes.usdc")
    stage.GetRootLayer().subLayerPaths.append(meshes.identifier)
    paths = paths_of(robot)
    notes: list[str] = []
    _write_units(stage)
    root = UsdGeom.Xform.Define(stage, Sdf.Path(paths.root)).GetPrim()
    stage.SetDefaultPrim(root)
    looks = MaterialWriter(stage=stage, root=paths.root, layer_folder=layer_folder, texture_folder=textures)
    masters = MeshPrototypes(stage=stage, layer=meshes)
    add_links(stage, robot, paths, masters, looks, notes)
    add_joints(stage, robot, paths, notes)
    add_loops(stage, robot, paths)
    add_filtered_pairs(stage, robot, paths)
    add_sensors(stage, robot, paths, masters)
    _write_metadata(root, robot)
    _add_scene(stage)
    return Built(
        stage=stage,
        meshes=meshes,
        images=tuple(looks.textures.values()),
        notes=(*notes, *looks.notes),
    )


def _write_units(stage: Any) -> None:

    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.GetRootLayer().customLayerData = {"creator": f"Roboyard {__version__}"}


def _write_metadata(root: Any, robot: RobotModel) -> None:
    """Write the custom data that OmniGibson reads from a model; it expects empty vector arrays for empty
    lists.
    """
    place(root, (0, 0, 0), (0, 0, 0, 1))
    kinds = Sdf.ValueTypeNames
    set_attribute(root, "ig:nativeBB", kinds.Vector3f, vec3f(robot.metadata.bbox_size))
    set_attribute(root, "ig:offsetBaseLink", kinds.Vector3f, vec3f(robot.metadata.base_link_offset))
    set_attribute(root, "ig:category", kinds.String, robot.category)
    set_attribute(root, "ig:model", kinds.String, robot.name)
    empty = Vt.Vec3fArray()
    metadata = {"meta_links": {}, "link_tags": {}, "object_parts": empty, "orientations": empty}
    root.SetCustomDataByKey("metadata", metadata)


def _add_scene(stage: Any) -> None:

    scene = UsdPhysics.Scene.Define(stage, "/physicsScene")
    scene.CreateGravityDirectionAttr(Gf.Vec3f(0.0, 0.0, -1.0))
    scene.CreateGravityMagnitudeAttr(9.81)

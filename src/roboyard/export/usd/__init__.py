"""A robot as a USDA stage for Isaac Sim, OmniGibson, Newton and everything else that reads UsdPhysics.

| concept | where it goes |
| --- | --- |
| the robot | `/<name>`, Xform, default prim, with `ig:` attributes and custom data `metadata` |
| units | z up, metersPerUnit 1, kilogramsPerUnit 1 |
| link | `/<name>/<link>`, Xform with RigidBodyAPI, MassAPI, PhysxRigidBodyAPI; pose with all joints at zero |
| inertial | `physics:mass`, `centerOfMass`, `diagonalInertia`, `principalAxes`, always all four |
| link without mass | a trace of the robot's mass, so that no engine invents a kilogram |
| visual | `/<name>/<link>/visuals/<shape>`: Mesh, or Cube, Sphere, Cylinder, Capsule |
| collision | `/<name>/<link>/collisions/<shape>`, purpose guide, CollisionAPI, MeshCollisionAPI |
| mesh | once, a class under `/visuals/<link>` or `/colliders/<link>` of the sublayer `<name>_meshes.usdc` |
| material | `/<name>/Looks/<material>`, UsdPreviewSurface; colours of faces as subsets; images as PNG |
| surface friction, restitution | `/<name>/PhysicsMaterials/<link>` |
| joint | `/<name>/<parent link>/<joint>`; a planar one is a generic joint with three locks |
| floating joint | none: a free body needs no joint |
| axis | `physics:axis` where it is +x, +y or +z; for any other the joint frames are turned to it |
| position limits | `physics:lowerLimit`, `upperLimit` (degrees for revolute); none for none |
| velocity limit, friction | PhysxJointAPI: `maxJointVelocity` (degrees/s for revolute), `jointFriction` |
| drive | DriveAPI, effort limit; no gain is effort, damping alone velocity, both position |
| joint state | PhysicsJointStateAPI, zero |
| mimic | NewtonMimicAPI and PhysxMimicJointAPI; no drive |
| loop joint | joint with `excludeFromArticulation` |
| articulation root | ArticulationRootAPI on the root link |
| links that overlap at rest | FilteredPairsAPI |
| camera | `/<name>/<link>/Camera`: focal length 17, clipping from 1 mm to 1000 km |
| lidar | `/<name>/<link>/Lidar`: type Lidar with Isaac's attributes |
| end-effector marker | `/<name>/<link>/VisualSphere`: Mesh, 1 cm across, no collision |
| name that USD forbids | nearest free identifier; the original in `displayName` and custom data `urdf_name` |
| world | `/physicsScene` with gravity 9.81 along -z |

Schemas of PhysX, Isaac and Newton are not part of OpenUSD: they are applied by name, with attributes of the
types that those programs declare, which OpenUSD's validators accept.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from roboyard.export.export_result import ExportResult

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


def write(robot: RobotModel, path: Path | str, *, textures: Path | str | None = None) -> ExportResult:
    """Write a robot as a USD layer, with a binary one for its meshes and its images beside it.

    Args:
        robot: what to write.
        path: `.usda` (or `.usd`, `.usdc` for binary); the meshes go to `<stem>_meshes.usdc`.
        textures: folder for images; `material` beside the file by default. The layer names them relatively.

    Raises:
        MissingExtraError: OpenUSD is not installed.
        MeshError: a mesh file cannot be read.
        OSError: a file cannot be written.
    """
    from roboyard.export.usd.stage import build

    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(textures) if textures is not None else target.parent / "material"
    built = build(robot, target.parent, folder)
    return ExportResult(files=(*built.save(target), *built.images), notes=built.notes)

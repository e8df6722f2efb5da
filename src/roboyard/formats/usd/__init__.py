"""A robot as a USDA stage for Isaac Sim, OmniGibson, Newton and everything else that reads UsdPhysics.

| concept | where it goes |
| --- | --- |
| the robot | `/<name>`, Xform, default prim; `ig:nativeBB`, `ig:offsetBaseLink`, `ig:category`, `ig:model`, custom data `metadata` |
| units | z up, metersPerUnit 1, kilogramsPerUnit 1 |
| link | `/<name>/<link>`, Xform with RigidBodyAPI, MassAPI, PhysxRigidBodyAPI; pose with all joints at zero |
| inertial | `physics:mass`, `centerOfMass`, `diagonalInertia`, `principalAxes`, always all four |
| link without mass | a trace of the robot's mass, so that no engine invents a kilogram |
| visual | `/<name>/<link>/visuals/<shape>`: Mesh, or Cube, Sphere, Cylinder, Capsule |
| collision | `/<name>/<link>/collisions/<shape>`, purpose guide, CollisionAPI, for meshes MeshCollisionAPI with the approximation |
| mesh | once, as a class under `/visuals/<link>` or `/colliders/<link>`; the prims above refer to it |
| material, face colours | `/<name>/Looks/<material>`, UsdPreviewSurface; face colours as subsets; images as PNG in the textures folder |
| surface friction, restitution | `/<name>/PhysicsMaterials/<link>` |
| joint | `/<name>/<parent link>/<joint>`: Revolute, Prismatic, Fixed, Spherical; planar: a generic joint with three locks |
| floating joint | none: a free body needs no joint |
| axis | `physics:axis` where it is +x, +y or +z; for any other the joint frames are turned to it |
| position limits | `physics:lowerLimit`, `upperLimit` (degrees for revolute); none for none |
| velocity limit, friction | PhysxJointAPI `physxJoint:maxJointVelocity` (degrees/s for revolute), `physxJoint:jointFriction` |
| drive | DriveAPI with the effort limit; gains: both zero is effort, damping alone is velocity, both is position |
| joint state | PhysicsJointStateAPI, zero |
| mimic | NewtonMimicAPI and PhysxMimicJointAPI; no drive |
| articulation root | ArticulationRootAPI on the root link |
| links that may touch | FilteredPairsAPI |
| camera | `/<name>/<link>/Camera`: focal length 17, clipping from 1 mm to 1000 km |
| lidar | `/<name>/<link>/Lidar`: type Lidar with Isaac's attributes |
| end-effector marker | `/<name>/<link>/VisualSphere`: Mesh, 1 cm across, no collision |
| name that USD forbids | nearest free identifier; the original in `displayName` and custom data `urdf_name` |
| world | `/physicsScene` with gravity 9.81 along -z |

Schemas of PhysX, Isaac and Newton are not part of OpenUSD: they are applied by name, with attributes of the
types that those programs declare, which OpenUSD's validators accept.
"""

from __future__ import annotations

from roboyard.formats.usd.stage import write

__all__ = ["write"]

"""A robot as MJCF that stock MuJoCo loads, its meshes beside it.

| concept | where it goes |
| --- | --- |
| link | `<body>` of the same name and frame, never fused |
| root | fixed to the world; on a `<freejoint>` if asked to float, or on wheels |
| inertial | `<inertial>` with principal moments; geoms have no mass |
| moving part without mass | a trace of the robot's mass, since MuJoCo cannot move nothing |
| visual | geom of class `visual` (group 2, no contact); a mesh of several colours becomes a geom for each |
| collision | geom of class `collision` (group 3); a mesh its convex hull, bounding sphere or box |
| mesh | `meshes/*.stl`, with texture coordinates `meshes/*.obj`; each distinct one once |
| material, texture | `<material>`, `textures/*.png` |
| revolute, continuous | hinge |
| prismatic | slide |
| spherical | ball |
| planar | two slides and a hinge, `<joint>_x`, `_y`, `_r` |
| floating (inside the tree) | three slides and a ball, `<joint>_x`, `_y`, `_z`, `_r` |
| limits, damping, friction | `range` (at least 1e-9 either way), `damping`, `frictionloss` |
| mimic | `<equality><joint>` |
| loop joint | `<connect>` or `<weld>` between sites; its links are excluded from contact |
| drive | `<position>`, `<velocity>` or `<motor>`, effort limit; gains from the inertia the joint moves |
| links that overlap at rest, joined links | `<exclude>` |
| camera | `<camera>` with the field of view of the stage's camera |
| lidar, end-effector marker | `<site>` |
| sensors of driven joints | `jointpos`, `jointvel`, `jointactuatorfrc`; of markers `framepos`, `framequat` |
| rest posture | `<key name="home">` |
| link called `world` | `world_link`, for MuJoCo's own world has that name |
"""

from __future__ import annotations

from roboyard.export.mjcf.document import write

__all__ = ["write"]

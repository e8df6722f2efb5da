"""Writers of other programs' files; each translates a `RobotModel` and decides nothing.

| module | writes | read by |
| --- | --- | --- |
| `urdf` | cleaned URDF with its meshes beside it | anything |
| `usd` | USDA stage | Isaac Sim, OmniGibson, Newton, usdview |
| `mjcf` | MJCF with its meshes beside it | MuJoCo |
| `curobo` | robot configurations, three layouts | cuRobo, OmniGibson |
| `xrdf` | what a planner needs beside the URDF | Isaac Sim, cuMotion |
| `definition` | RobotDefinition skeleton | OmniGibson, Roboyard |

Each has a function `write(robot, path, ...)` that returns an `ExportResult`: the files, and a note for
everything that the format cannot hold. docs/concept_mapping.md has all the tables.
"""

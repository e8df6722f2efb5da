"""Writers: an imported robot becomes files that other programs read.

| module | writes | read by |
| --- | --- | --- |
| `urdf` | cleaned URDF with its meshes beside it | anything |
| `usd` | USDA stage | Isaac Sim, OmniGibson, Newton, usdview |
| `mjcf` | MJCF with its meshes beside it | MuJoCo |
| `curobo` | robot configurations, three layouts | cuRobo, OmniGibson |
| `xrdf` | what a planner needs beside the URDF | Isaac Sim, cuMotion |
| `definition` | RobotDefinition skeleton | OmniGibson, Roboyard |

Each has a function `write(robot, where, ...)` that returns a `Written`: the files, and a note for everything
the format has no place for. Writers translate and decide nothing; docs/concept_mapping.md has all the tables.
"""

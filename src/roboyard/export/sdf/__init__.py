"""A robot as an SDF model for Gazebo.

| concept | where it goes |
| --- | --- |
| links | `<link>`, posed in their parent's frame; a fixed leaf without shape and mass is a `<frame>` |
| joints | revolute, continuous, prismatic, fixed, ball; planar as slides and a turn; floating omitted |
| a base that stands still | a fixed joint to `world`; others float |
| loop joints | joints with both links in the tree |
| mimic | `<mimic>`, which makes the file SDF 1.11; others are 1.8 |
| meshes and textures | where they are, below the shared folder; else copied beside the file |
| sensors | cameras and lidars |
| drives | Gazebo Sim's plugins for joint states, joint trajectories and differential drives |
"""

from roboyard.export.sdf.model import write

__all__ = ["write"]

"""Building MuJoCo bodies, joints, geoms and meshes from a robot description."""

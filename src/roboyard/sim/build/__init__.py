"""A robot description becomes MuJoCo bodies, joints, geoms and meshes."""

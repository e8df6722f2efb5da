"""MJCF, MuJoCo's own format: checked before MuJoCo reads it, and read as a robot description."""

"""The state of a client: bodies, joints, constraints, textures, user data, logs, debug items and settings."""

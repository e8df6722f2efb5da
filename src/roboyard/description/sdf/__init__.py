"""SDF files (1.2 to 1.11) as robot descriptions; see `roboyard.description.sdf.build`."""

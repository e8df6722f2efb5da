"""Kind of robot from its geometry and joints: wheels, grippers, arms, support on the floor, motor limits."""

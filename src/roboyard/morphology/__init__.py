"""What a robot is, from its geometry: wheels, grippers, arms, support, motor limits."""

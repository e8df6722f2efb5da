"""Planning data: collision spheres, self-collision matrix and rest posture."""

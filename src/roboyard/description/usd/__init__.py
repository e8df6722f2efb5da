"""USD stages as robot descriptions."""

"""What the inspector draws on top of a robot."""

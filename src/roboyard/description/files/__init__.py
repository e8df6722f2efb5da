"""Files that a robot description names: found, bounded to the robot's folders, copied."""

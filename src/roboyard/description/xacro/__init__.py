"""Expand xacro files without ROS, in a confined child process."""

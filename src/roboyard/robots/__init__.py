"""Robots as data: an imported model and one definition file make a robot that can be driven."""

"""Compiled loops of the sensors, imported on first use."""

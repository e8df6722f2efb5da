"""Compiled loops of the sensors. Import on first use only."""

"""Compiled loops of the software renderer: plain functions over flat arrays."""

"""Checks of a finished package: fit of its shapes, and its files read back."""

"""Edits made in the inspector, and the files they are saved to."""

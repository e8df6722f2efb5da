"""Boxes around links in a tree, and the table of the pairs whose boxes meet."""

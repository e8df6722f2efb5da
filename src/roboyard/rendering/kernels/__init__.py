"""Compiled loops of the software renderer: plain functions over flat arrays.

The compiler's store on disk knows when a kernel's own file changed, not when one did that it calls: while
editing, delete the __pycache__ folder beside this file.
"""

"""Mesh files as triangles: OBJ, STL, COLLADA, glTF and PLY."""

"""The base of a robot: wheels with their parts, rotors, and how these move it."""

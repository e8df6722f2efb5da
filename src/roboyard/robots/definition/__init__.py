"""The robot definition file: schema, checks, postures and joint groups."""

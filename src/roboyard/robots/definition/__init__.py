"""The robot definition file: schema, loading, checks, postures and joint groups."""

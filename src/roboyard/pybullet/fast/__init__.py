"""Commands as machine code, which programs enter after many calls."""

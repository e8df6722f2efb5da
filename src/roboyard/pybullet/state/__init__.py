"""What a client keeps: bodies, joint tables, constraints, debug items and filters."""

"""Commands of constraints as machine code: created, read and removed before and after they are built."""

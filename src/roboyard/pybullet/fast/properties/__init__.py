"""Commands with many optional arguments as machine code: their state, and what they write."""

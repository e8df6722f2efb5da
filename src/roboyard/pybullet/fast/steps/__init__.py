"""Steps and the detection of contacts as machine code."""

"""A world in another process: the wire format, the server behind `roboyard serve`, and its clients."""

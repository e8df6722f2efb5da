"""A world in another process: the server of `roboyard serve`, and its clients."""

"""Where two shapes are closest to each other or deepest in each other, and contacts there."""

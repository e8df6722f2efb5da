"""The points of contacts that are kept from step to step, and saved."""

"""The last minute of a shown world: recorded, shown again and saved."""

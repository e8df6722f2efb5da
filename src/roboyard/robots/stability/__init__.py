"""Support, tipping and ground clearance of robots that stand on a floor."""

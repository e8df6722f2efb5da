"""PyBullet's functions by topic, in the order of its quickstart guide."""

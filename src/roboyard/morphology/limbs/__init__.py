"""Limbs of a robot: chains of joints, what they are (leg, arm, head), the trunk between them, hands."""

"""Grippers and hands: their fingers, which joints drive them, which way opens, and where they grasp."""

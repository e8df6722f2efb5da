"""The usual masks of MuJoCo's shapes."""

ALL_MASKS = 0x7FFFF
"""A conaffinity that matches every contype but those of groups. Bit 0 is common; the others hold the codes of
robots without self-collision (`roboyard.sim.build.group_masks`)."""

"""Statements of a robot's files beyond links and joints: simulator blocks, transmissions, an SRDF."""

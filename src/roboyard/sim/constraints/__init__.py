"""Constraints between links besides joints: welds, slides, points and gears."""

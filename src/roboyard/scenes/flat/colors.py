"""Colours of the flat."""

from __future__ import annotations

from roboyard.description.model import RGBA

PLASTER: RGBA = (0.93, 0.91, 0.87, 1.0)
PAINT: RGBA = (0.96, 0.96, 0.95, 1.0)
OAK: RGBA = (0.74, 0.58, 0.41, 1.0)
WALNUT: RGBA = (0.42, 0.29, 0.20, 1.0)
PARQUET: RGBA = (0.76, 0.63, 0.47, 1.0)
TILES: RGBA = (0.70, 0.73, 0.75, 1.0)
STONE: RGBA = (0.33, 0.34, 0.36, 1.0)
STEEL: RGBA = (0.72, 0.74, 0.77, 1.0)
BLACK: RGBA = (0.08, 0.08, 0.09, 1.0)
GLASS: RGBA = (0.70, 0.84, 0.92, 0.35)
PORCELAIN: RGBA = (0.97, 0.97, 0.98, 1.0)
WATER: RGBA = (0.62, 0.78, 0.84, 1.0)
SAGE: RGBA = (0.55, 0.64, 0.54, 1.0)
NAVY: RGBA = (0.22, 0.30, 0.42, 1.0)
LINEN: RGBA = (0.88, 0.85, 0.79, 1.0)
TERRACOTTA: RGBA = (0.76, 0.43, 0.32, 1.0)
MUSTARD: RGBA = (0.83, 0.64, 0.24, 1.0)
LEAF: RGBA = (0.27, 0.47, 0.25, 1.0)
GLOW: RGBA = (1.0, 0.95, 0.80, 1.0)

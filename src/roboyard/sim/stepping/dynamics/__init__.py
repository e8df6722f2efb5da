"""Compiled loops over the inertias of kinematic trees."""

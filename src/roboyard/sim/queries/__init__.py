"""Contacts, distances, rays and the default view."""

"""Contacts, distances and rays."""

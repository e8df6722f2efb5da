"""Inactive compiled bodies in reserve, so that adding a simple body needs no compile."""

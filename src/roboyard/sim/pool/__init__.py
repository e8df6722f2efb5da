"""Compiled bodies kept ready, so that adding a simple body needs no compile."""

"""Gouges: found on every motion, and what is done about them."""

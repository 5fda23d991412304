"""Robots: a file for each family, and what holds for that family alone."""

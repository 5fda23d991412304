"""Surfaces on which strategies draw lines: the part itself, or the drive surface of a ball."""

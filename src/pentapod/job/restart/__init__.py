"""Restart of a program in the middle, from the park pose, with a checked way in."""

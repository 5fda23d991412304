"""Convex programs by interior-point methods."""

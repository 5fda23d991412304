"""Verified continuation: tubes about poses, each with exactly one solution in it."""

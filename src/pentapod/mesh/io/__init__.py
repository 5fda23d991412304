"""Mesh files: a file for each format."""

"""Offset surfaces of meshes."""

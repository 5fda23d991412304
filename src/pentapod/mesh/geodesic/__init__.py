"""Geodesics on meshes: distances along the surface, and straightest lines."""

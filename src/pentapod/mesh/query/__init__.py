"""Geometric queries on meshes: distances, swept penetration, slices."""

"""Geometric queries on meshes: distances, swept penetration, geodesics, slices."""

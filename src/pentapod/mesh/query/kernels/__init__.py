"""Compiled searches of a tree of facets: nearest points, depths in moving solids, rays."""

"""Identification: the geometry of a machine from what instruments measured of it."""

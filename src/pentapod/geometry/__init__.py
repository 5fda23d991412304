"""Geometry without a robot in it: rigid transforms, directions, polylines, Bernstein polynomials."""

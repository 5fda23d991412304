"""Convex quadratic programs, dense and banded, by one interior-point method."""

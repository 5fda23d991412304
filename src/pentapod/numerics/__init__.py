"""Arithmetic and solvers without geometry: compiled kernels, balls, Bernstein polynomials, banded systems.

Nothing is loaded from here: modules are imported where they are used, since compiled code is heavy.
"""

__all__: list[str] = []

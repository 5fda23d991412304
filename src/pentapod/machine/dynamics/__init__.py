"""Dynamics: the forces that the drives need along a path or for a program's rows."""

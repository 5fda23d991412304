"""Measuring: programs that take a machine to the poses in which an instrument measures it."""

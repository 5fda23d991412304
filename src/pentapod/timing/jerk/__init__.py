"""Jerk limits: the fastest law whose leg jerks hold."""

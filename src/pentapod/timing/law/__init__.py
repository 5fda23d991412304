"""Time laws and trajectories, and what timing has to know of a path."""

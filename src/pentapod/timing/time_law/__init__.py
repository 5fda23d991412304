"""Time laws s(t), trajectories, and refusals of paths that cannot be timed."""

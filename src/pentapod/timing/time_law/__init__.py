"""Time laws s(t) and trajectories; refusals of paths that have none."""

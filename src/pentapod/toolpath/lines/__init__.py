"""Lines on a surface: how far apart, over gaps, projected."""

"""The tool axis along the path: its spline, its smoothness cost, and the smoothing."""

"""The tool axis along the path: its spline, what it costs, and how it is smoothed."""

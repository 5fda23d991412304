"""Drawings of a set-up with dimensions, as SVG: outlines, the machine, the part, touch-off points."""

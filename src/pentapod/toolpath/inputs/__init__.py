"""Drawings, points, pictures and text to be engraved."""

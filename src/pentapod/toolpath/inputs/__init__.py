"""Readers of drawings, points and pictures, and lettering."""

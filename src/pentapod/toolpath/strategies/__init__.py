"""Strategies: each draws lines on a surface; a file for each, and the table of them."""

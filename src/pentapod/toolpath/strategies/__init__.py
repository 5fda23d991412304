"""Strategies: each makes contact paths on a surface; a file for each, and the table of them."""

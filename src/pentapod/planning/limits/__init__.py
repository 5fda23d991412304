"""Limits of tool poses, and their margins: one dimensionless number for each."""

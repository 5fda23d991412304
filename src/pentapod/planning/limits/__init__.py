"""Margins: one dimensionless number for every limit."""

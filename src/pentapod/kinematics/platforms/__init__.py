"""Robots that hold a rigid platform: legs end beside the line, and its turn about the line is held."""

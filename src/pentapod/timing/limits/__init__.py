"""The limits of the time law as rows along the path."""

"""Proposal: a job for a part, from its size and shape."""

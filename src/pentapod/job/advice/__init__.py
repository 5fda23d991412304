"""Advice for a job that cannot be done: changes that were planned, with a verdict that passed."""

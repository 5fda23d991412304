"""Specification and verdict: what a program is judged against, and the answer."""

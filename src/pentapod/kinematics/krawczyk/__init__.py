"""Krawczyk's operator on the leg equations, compiled: one line of poses, or many side by side."""

"""Leg paths: C3 curves of leg lengths through placed poses, between exact stops."""
